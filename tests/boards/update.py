#!/usr/bin/env python3
"""An amd64 image in QEMU under UEFI: it boots to a publishing node; an update goes to the other slot and is judged good; a
stranger's bundle is refused; an image whose node does not run goes back by itself. The update is recorded for power_cut."""
import fcntl
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import disk_log
import guest
from guest import run
import plant

PATIENCE_S = 120  # of a slot that is judged; the guest is emulated
BOOT_S = 1200     # on two busy cores
SETTLE_S, REST_MIN, WRITE_LIMIT_MB = 60, 3, 1.0
THIN_LIMIT_MB = 20.0

import image as board_image
import make_bundle  # of deploy/image, whose place guest knows
import make_disk
import make_root


def prepare(image):
    """The image, and bundles of it: of another version, of a stranger, and one whose node does not run. One at a time."""
    image.mkdir(parents=True, exist_ok=True)
    with (image / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return make_variants(image)


def make_variants(image):
    work = image / "work"
    made = work / "root/etc/imprint-version"
    if not (work / "root.squashfs").exists() or made.read_text().strip() != board_image.version_of_tree():
        run(sys.executable, plant.ROOT / "deploy/image/image.py", "--board", "amd64", "--out", image)
    variants = work / "variants"
    variants.mkdir(exist_ok=True)
    keys, stranger = guest.CACHE / "keys", guest.CACHE / "stranger"
    make_bundle.make_development_keys(stranger)
    if (variants / "v3.raucb").exists() and (variants / "v3.raucb").stat().st_mtime > (work / "root.squashfs").stat().st_mtime:
        return work
    os.environ.setdefault("SOURCE_DATE_EPOCH", "1700000000")
    root, packed = work / "root", work / "variant.squashfs"
    node, version = root / "usr/bin/imprint-node", (root / "etc/imprint-version").read_text()
    good_node = node.read_bytes()

    def bundle(name, number, who):
        make_bundle.make_bundle(variants / name, packed, work, "imprint-board-amd64", number, who / "cert.pem", who / "key.pem")

    (root / "etc/imprint-version").write_text("2\n")
    make_root.pack_root(root, packed)
    bundle("v2.raucb", "2", keys)
    make_bundle.make_thin(variants / "v2.raucb", keys / "cert.pem", keys / "key.pem")
    bundle("evil.raucb", "2", stranger)
    (root / "etc/imprint-version").write_text("3\n")
    node.write_text("#!/bin/sh\nexit 1\n")
    make_root.pack_root(root, packed)
    bundle("v3.raucb", "3", keys)
    node.write_bytes(good_node)
    (root / "etc/imprint-version").write_text(version)
    packed.unlink()
    return work


def make_board(line, work, folder, architecture="amd64", grub=pathlib.Path("/usr/lib/grub"), recorded=False):
    options = folder / "board.cfg"
    options.write_text(f'set board_options="imprint.patience_s={PATIENCE_S}"\n')
    disk = folder / "disk.img"
    make_disk.make_disk(disk, work / "root.squashfs", folder, line.board_folder("cam1", f"uefi-{architecture}"), options, 512,
                        architecture, grub)
    console = folder / "console.log"
    console.unlink(missing_ok=True)
    return plant.Board(disk, console, recorded=recorded, architecture=architecture)


class Cycle:
    def __init__(self, line, board, work):
        self.line, self.board, self.bundles = line, board, work / "variants"
        self.faults = []

    def check(self, claim, holds, detail=""):
        print(f"{'ok  ' if holds else 'FAIL'} {claim}{': ' + str(detail) if detail else ''}", flush=True)
        if not holds:
            self.faults.append(claim)

    def wait_good(self):
        """The board's own word that its slot is good."""
        def good():
            state = self.line.firmware()
            return state if state and state["slot_good"] else None
        return plant.wait_for(good, BOOT_S, "a slot judged good", self.board.running)

    def update(self, bundle, version):
        return self.line.imprint("fleet", "update", *self.line.line(), "--camera", "cam1", "--bundle", self.bundles / bundle, "--version",
                                 version, "--serve", f"{plant.HOST_IN_GUEST}:{plant.free_port()}", "--board-timeout", 2 * BOOT_S, "--timeout", 5,
                                 timeout_s=2 * BOOT_S + 60, check=False)

    def boots_and_measures(self):
        state, took_s = self.wait_good()
        self.check("the image boots to a publishing node, its slot is judged good", state["slot"] == "A", f"{took_s:.0f} s, {state['image_version']}")
        self.line.imprint("trigger", *self.line.line(), "--session", "S", "--observation", 0, "--rotation-deg", 0, "--expect", 1, check=False)
        def seen():
            camera = self.line.camera()
            return camera if camera and camera["health"]["frames"] else None
        camera, _ = plant.wait_for(seen, 300, "a frame", self.board.running)
        self.check("a triggered frame shows its targets", camera["health"]["targets_seen"] >= 10, camera["health"]["targets_seen"])

    def writes_little(self):
        time.sleep(SETTLE_S)
        before = self.board.written_bytes()
        time.sleep(60 * REST_MIN)
        rate = (self.board.written_bytes() - before) / 1e6 / REST_MIN
        self.check(f"at rest less than {WRITE_LIMIT_MB} MB a minute is written", rate < WRITE_LIMIT_MB, f"{rate:.3f} MB a minute over {REST_MIN} min")

    def refuses_a_stranger(self):
        done = self.update("evil.raucb", "2")
        self.check("a bundle signed by a stranger is refused", done.returncode == 1 and "signature" in done.stderr,
                   done.stderr.strip().splitlines()[-2:])
        state = self.line.firmware()
        self.check("and nothing has changed", state and state["slot"] == "A" and state["slot_good"])

    def starts_without_environment(self):
        """As when power was cut while the boot loader's environment was written: nobody knows then that the broken image's slot is bad."""
        self.board.cut_power()
        empty = self.board.console.with_name("grubenv")
        empty.write_bytes(b"")
        run("mcopy", "-o", "-i", f"{self.board.disk}@@1M", empty, "::grub/grubenv")
        self.board.start()
        state, took_s = self.wait_good()
        self.check("without the boot loader's environment the board finds the slot that is good", state["image_version"] == "2",
                   f"slot {state['slot']} after {took_s:.0f} s")

    def updates(self):
        """Gives when the update began and when it was over, in s."""
        begin = time.monotonic()
        done = self.update("v2.thin.raucb", "2")
        end = time.monotonic()
        state = self.line.firmware()
        self.check("an update goes to the other slot, boots and is judged good",
                   done.returncode == 0 and state and state["image_version"] == "2" and state["slot_good"],
                   f"{state and state['slot']} in {end - begin:.0f} s {done.stderr.strip()[-300:]}")
        fetched = re.search(r"([\d.]+) MB were fetched", done.stderr)
        self.check("and fetches only what differs", fetched and float(fetched[1]) < THIN_LIMIT_MB, fetched and fetched[0])
        return begin, end

    def goes_back(self):
        before = self.line.firmware()
        done = self.update("v3.raucb", "3")
        state, _ = self.wait_good()
        self.check("an image whose node does not run goes back by itself, and says why",
                   done.returncode == 1 and state["image_version"] == before["image_version"] and "slot" in state["rolled_back"],
                   done.stderr.strip().splitlines()[-2:])


def main(build):
    if os.geteuid() != 0:
        print("needs root, to make a root file system")
        return 1
    folder = guest.CACHE / "update"
    shutil.rmtree(folder / "certs", ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    work = prepare(pathlib.Path(build).resolve() / "image")
    line = plant.Plant(build, folder)
    board = make_board(line, work, folder, recorded=True)
    run("cp", "--sparse=always", board.disk, folder / "base.img")  # with the recording what power_cut needs
    cycle = Cycle(line, board, work)
    with line:
        try:
            with board:
                cycle.boots_and_measures()
                cycle.writes_little()
                cycle.refuses_a_stranger()
                with disk_log.Recorder(board.logs) as recorder:
                    begin_s, end_s = cycle.updates()
                recorder.save(folder / "recording.json", begin_s, end_s)
                board.recorded = False
                cycle.goes_back()
                cycle.starts_without_environment()
        except RuntimeError as error:
            cycle.check(str(error), False)
        if cycle.faults:
            print(board.printed()[-3000:])
    return 1 if cycle.faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
