"""A guest with one of Debian's kernels in QEMU, for what needs a kernel that the build machine does not have.

The kernel comes as Debian's package, fetched by apt once and kept in .cache/boards.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
CACHE = ROOT / ".cache" / "boards"
sys.path.insert(0, str(ROOT / "deploy" / "image"))
import kernel_package
from kernel_package import run


def accelerator():
    """KVM where the processor virtualises by itself; else emulation. A /dev/kvm without vmx or svm in /proc/cpuinfo is
    virtualisation by software, in which Debian's kernels do not start."""
    hardware = re.search(r"^flags\s*:.*\b(vmx|svm)\b", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    if hardware and os.access("/dev/kvm", os.R_OK | os.W_OK):
        return ["-accel", "kvm", "-cpu", "host"]
    return ["-accel", "tcg,thread=multi", "-cpu", "max"]


def modules_in_order(kernel, names):
    """The module files of `names`, each behind what it needs."""
    modules = kernel_package.Modules(kernel)
    return [modules.folder / file for file in modules.named(names)]


def shared_libraries(program):
    listing = run("ldd", program, capture_output=True).stdout
    return {library: library for library in re.findall(r"(/\S+)", listing)}


def make_initramfs(archive, kernel, modules, programs, script, files=None, libraries_of=shared_libraries):
    """A root of busybox, kernel modules (name -> parameters), programs with their libraries, `files` (path in the guest
    -> file), and `script` to run. `libraries_of` gives a program's libraries, likewise."""
    root = archive.with_suffix(".root")
    shutil.rmtree(root, ignore_errors=True)
    for folder in ("bin", "proc", "sys", "dev", "tmp", "modules"):
        (root / folder).mkdir(parents=True)
    shutil.copy(shutil.which("busybox"), root / "bin" / "busybox")
    for program in programs:
        shutil.copy(program, root / "bin" / program.name)
        files = {**libraries_of(program), **(files or {})}
    for place, file in (files or {}).items():
        target = root / place.lstrip("/")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, target)
    lines = []
    for file in modules_in_order(kernel, modules) if modules else []:
        shutil.copy(file, root / "modules")
        lines.append(f"insmod /modules/{file.name} {modules.get(file.stem.replace('-', '_'), '')}")
    (root / "run.sh").write_text(script, encoding="utf-8")
    (root / "init").write_text(
        "#!/bin/busybox sh\n"
        "/bin/busybox --install -s /bin\nexport PATH=/bin HOME=/tmp\n"
        "mount -t proc p /proc; mount -t sysfs s /sys; mount -t devtmpfs d /dev; mount -t tmpfs t /tmp\n"
        "ip link set lo up\n" + "\n".join(lines) + "\nsh /run.sh\necho GUEST-EXIT $?\npoweroff -f\n",
        encoding="utf-8")
    (root / "init").chmod(0o755)
    with archive.open("wb") as out:
        find = subprocess.Popen(["find", ".", "-print0"], cwd=root, stdout=subprocess.PIPE)
        cpio = subprocess.Popen(["cpio", "--quiet", "-o0", "-H", "newc"], cwd=root, stdin=find.stdout, stdout=subprocess.PIPE)
        run("gzip", "-1", stdin=cpio.stdout, stdout=out)
        if find.wait() or cpio.wait():
            raise RuntimeError("the initramfs could not be packed")
    shutil.rmtree(root)


def boot(kernel, initramfs, log, timeout_s, memory="2G"):
    """Runs the guest until it powers off; gives what it printed and the status of its script."""
    vmlinuz = next((kernel / "boot").glob("vmlinuz-*"))
    begin = time.monotonic()
    with log.open("wb") as out:
        subprocess.run(
            ["qemu-system-x86_64", "-machine", "q35", *accelerator(), "-smp", "2", "-m", memory, "-nographic", "-no-reboot",
             "-nic", "none", "-kernel", vmlinuz, "-initrd", initramfs, "-append", "console=ttyS0 quiet loglevel=4 panic=-1 mitigations=off"],
            stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT, timeout=timeout_s, check=True)
    printed = log.read_text(encoding="utf-8", errors="replace").replace("\r\n", "\n")
    exit_line = re.search(r"GUEST-EXIT (\d+)", printed)
    return printed, int(exit_line.group(1)) if exit_line else None, time.monotonic() - begin
