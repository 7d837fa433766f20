"""A plant for one emulated board: authority, fusion on TLS, a rendered rig, and the board's folder (board.toml, identity/, rig/).

The guest reaches this machine at 10.0.2.2, QEMU's user network.
"""
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time

import guest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "tests/data/small_forge.toml"
HOST_IN_GUEST = "10.0.2.2"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Plant:
    def __init__(self, build, folder, kept=False):
        """`kept`: the authority and the port of the plant that was there before, whose boards are to find it again."""
        self.build, self.folder = pathlib.Path(build).resolve(), pathlib.Path(folder)
        self.certs, self.rig = self.folder / "certs", self.folder / "rig"
        self.fusion = None
        if kept:
            self.port = int((self.folder / "port").read_text())
            return
        self.port = free_port()
        (self.folder / "port").write_text(str(self.port))
        shutil.rmtree(self.certs, ignore_errors=True)
        self.imprint("certs", "init", "--plant", "forge", "--dir", self.certs)
        self.issue("fusion", "fusion", "--host", "127.0.0.1", "--host", HOST_IN_GUEST)
        self.issue("engineer", "engineer")
        if not (self.rig / "session.toml").exists():
            self.imprint("simulate", SCENE, "--out", self.rig)

    def imprint(self, *arguments, timeout_s=300, check=True):
        done = subprocess.run([str(self.build / "cli/imprint"), *map(str, arguments)], capture_output=True, text=True, timeout=timeout_s,
                              check=False)
        if check and done.returncode != 0:
            raise RuntimeError(f"imprint {' '.join(map(str, arguments))}: {done.stderr}")
        return done

    def issue(self, name, role, *arguments):
        self.imprint("certs", "issue", name, "--role", role, *arguments, "--dir", self.certs)

    def line(self):
        """Options that make a command speak to this line as its engineer."""
        return ("--connect", f"tls/127.0.0.1:{self.port}", "--identity", self.certs / "issued/engineer")

    def board_folder(self, camera="cam1", kind="uefi-amd64"):
        folder = self.folder / f"board-{camera}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        self.issue(camera, "camera")
        shutil.copytree(self.certs / "issued" / camera, folder / "identity")
        shutil.copytree(self.rig, folder / "rig")
        (folder / "board.toml").write_text(
            f'[board]\nkind = "{kind}"\ncamera_id = "{camera}"\n[network]\naddress = "dhcp"\ndns = []\n'
            f'[time]\nservers = ["{HOST_IN_GUEST}"]\n[fusion]\nconnect = ["tls/{HOST_IN_GUEST}:{self.port}"]\n'
            '[camera]\nsource = "folder"\n')
        return folder

    def __enter__(self):
        config = self.folder / "fusion.toml"
        config.write_text(
            f'[fusion]\nrig = "{self.rig}/rig.toml"\ndatabase = "imprint.db"\n[zenoh]\nlisten = ["tls/127.0.0.1:{self.port}"]\n'
            f'identity = "{self.certs}/issued/fusion"\naccess = "{self.certs}/access.json"\n[page]\nport = 0\n')
        with (self.folder / "fusion.log").open("ab") as log:
            self.fusion = subprocess.Popen([str(self.build / "fusion/imprint-fusion"), "--config", str(config)], stdout=log, stderr=log)
        return self

    def __exit__(self, *_):
        self.fusion.send_signal(signal.SIGTERM)
        try:
            self.fusion.wait(30)
        except subprocess.TimeoutExpired:
            self.fusion.kill()
            self.fusion.wait()

    def camera(self, camera="cam1"):
        """What fusion knows of the camera; nothing when it is not connected."""
        done = self.imprint("status", *self.line(), "--json", check=False)
        if done.returncode != 0:
            return None
        found = next(c for c in json.loads(done.stdout)["cameras"] if c["id"] == camera)
        return found if found["alive"] else None

    def firmware(self, camera="cam1"):
        """What the board says of its image; nothing when it does not answer."""
        done = self.imprint("fleet", "status", *self.line(), "--camera", camera, "--timeout", 5, "--json", check=False)
        if done.returncode != 0:
            return None
        return json.loads(done.stdout)["boards"][0]


def wait_for(condition, timeout_s, what, still_there=lambda: True):
    begin = time.monotonic()
    while time.monotonic() - begin < timeout_s:
        if not still_there():
            raise RuntimeError(f"the board has ended while waited for: {what}")
        found = condition()
        if found:
            return found, time.monotonic() - begin
        time.sleep(2)
    raise RuntimeError(f"not within {timeout_s} s: {what}")


# By architecture: QEMU, UEFI's code and its variables.
MACHINES = {
    "amd64": (["qemu-system-x86_64", "-machine", "q35", *guest.accelerator()], "/usr/share/OVMF/OVMF_CODE_4M.fd", "/usr/share/OVMF/OVMF_VARS_4M.fd"),
    "arm64": (["qemu-system-aarch64", "-machine", "virt", "-accel", "tcg,thread=multi", "-cpu", "cortex-a72", "-device", "virtio-rng-pci"],
              "/usr/share/AAVMF/AAVMF_CODE.fd", "/usr/share/AAVMF/AAVMF_VARS.fd"),
}


class Board:
    """A disk that runs in QEMU under UEFI, with a USB stick if given; what it prints goes to `console`.

    When the board restarts, QEMU ends and is started anew: after a warm reset OVMF takes minutes in emulation.
    """

    def __init__(self, disk, console, memory="1G", recorded=False, architecture="amd64", processors=2):
        """`recorded`: what is written to the disk goes to `logs` too, one file a start (power_cut.py)."""
        self.disk, self.console, self.memory, self.recorded = disk, console, memory, recorded
        self.processors = str(processors)
        self.logs = []
        self.variables = pathlib.Path(str(disk) + ".vars")
        self.control = pathlib.Path(tempfile.gettempdir()) / f"imprint-board-{os.getpid()}.qmp"  # its path must be short
        self.machine, self.firmware, variables = MACHINES[architecture]
        shutil.copy(variables, self.variables)
        self.process = self.keeper = None
        self.powered = threading.Event()

    def disk_option(self):
        file = f"driver=file,filename={self.disk}"
        if not self.recorded:
            return f"node-name=disk,{file}"
        log = pathlib.Path(f"{self.disk}.log{len(self.logs)}")
        log.write_bytes(b"")
        self.logs.append(log)
        return f"node-name=disk,driver=blklogwrites,file.{file.replace(',', ',file.')},log.driver=file,log.filename={log}"

    def launch(self, stick):
        command = [*self.machine, "-smp", self.processors, "-m", self.memory,
                   "-nographic", "-no-reboot", "-drive", f"if=pflash,format=raw,readonly=on,file={self.firmware}",
                   "-drive", f"if=pflash,format=raw,file={self.variables}",
                   "-blockdev", self.disk_option(), "-device", "virtio-blk-pci,drive=disk,bootindex=0", "-nic", "user,model=virtio-net-pci",
                   "-device", "i6300esb", "-watchdog-action", "reset", "-qmp", f"unix:{self.control},server=on,wait=off"]
        if stick:
            command += ["-device", "qemu-xhci", "-drive", f"if=none,id=stick,file={stick},format=raw",
                        "-device", "usb-storage,drive=stick"]
        with self.console.open("ab") as out:
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)

    def start(self, stick=None):
        def keep():
            while self.process.wait() == 0 and self.powered.is_set():
                self.launch(stick)
        self.powered.set()
        self.launch(stick)
        self.keeper = threading.Thread(target=keep, daemon=True)
        self.keeper.start()

    def running(self):
        return self.keeper is not None and self.keeper.is_alive()

    def cut_power(self):
        self.powered.clear()
        while self.running():
            self.process.kill()
            self.keeper.join(1)
        self.control.unlink(missing_ok=True)

    def written_bytes(self):
        """What the board has written to its disk since it was switched on."""
        with socket.socket(socket.AF_UNIX) as link, link.makefile("rw") as lines:
            link.connect(str(self.control))
            for command in ("qmp_capabilities", "query-blockstats"):
                lines.write(json.dumps({"execute": command}) + "\n")
            lines.flush()
            for line in lines:
                answer = json.loads(line).get("return")
                if isinstance(answer, list):
                    return next(drive["stats"]["wr_bytes"] for drive in answer if drive.get("node-name") == "disk")
        raise RuntimeError("QEMU ended the connection")

    def printed(self):
        return self.console.read_text(encoding="utf-8", errors="replace") if self.console.exists() else ""

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.cut_power()
