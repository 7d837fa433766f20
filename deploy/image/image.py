#!/usr/bin/env python3
"""./dev image: a board's disk, the update bundle of the same root, and its software bill of materials."""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import time

from kernel_package import fetch_foreign_boot, fetch_kernel, run
from make_bundle import make_bundle, make_development_keys, make_thin
from make_disk import make_disk
from make_root import SUITE, make_root

ROOT = pathlib.Path(__file__).resolve().parents[2]
CACHE = ROOT / ".cache" / "boards"


def parse():
    parser = argparse.ArgumentParser(prog="./dev image")
    parser.add_argument("--board", required=True, choices=["amd64", "arm64"])
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/image")
    parser.add_argument("--build", type=pathlib.Path, help="folder the node was built in (default: build, build-arm64)")
    parser.add_argument("--config", type=pathlib.Path, help="folder with board.toml, identity/ and rig/ for the data partition")
    parser.add_argument("--data-mb", type=int, default=256, help="size of the data partition")
    parser.add_argument("--cert", type=pathlib.Path, help="certificate bundles are signed with (default: a development key)")
    parser.add_argument("--key", type=pathlib.Path)
    parser.add_argument("--keyring", type=pathlib.Path, help="who may sign bundles for this board (default: --cert)")
    options = parser.parse_args()
    options.build = options.build or ROOT / ("build" if options.board == "amd64" else "build-arm64")
    return options


def version_of_tree():
    meson = next(line for line in (ROOT / "meson.build").read_text().splitlines() if "version:" in line)
    short = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True, check=True)
    return meson.split("'")[1] + "+" + short.stdout.strip()


def boot_parts(architecture):
    """Folders of the kernel and of GRUB's modules, and busybox for the first steps."""
    if architecture == "amd64":
        return fetch_kernel(CACHE), pathlib.Path("/usr/lib/grub"), shutil.which("busybox")
    if not pathlib.Path("/proc/sys/fs/binfmt_misc/qemu-aarch64").exists():  # where systemd does not do it at its start
        run("/usr/lib/systemd/systemd-binfmt", "/usr/lib/binfmt.d/qemu-aarch64.conf")
    boot = fetch_foreign_boot(CACHE, architecture, SUITE)
    return boot, boot / "usr/lib/grub", boot / "bin/busybox"


def main():
    options = parse()
    if os.geteuid() != 0:
        print("image: needs root, to make a root file system", file=sys.stderr)
        return 2
    if bool(options.cert) != bool(options.key):
        print("image: --cert and --key go together", file=sys.stderr)
        return 2
    begin = time.monotonic()
    newest = run("git", "-C", ROOT, "log", "-1", "--format=%ct", capture_output=True).stdout.strip()
    os.environ.setdefault("SOURCE_DATE_EPOCH", newest)
    options.out.mkdir(parents=True, exist_ok=True)
    work = options.out / ("work" if options.board == "amd64" else f"work-{options.board}")
    work.mkdir(exist_ok=True)
    if not options.cert:
        make_development_keys(CACHE / "keys")
        options.cert, options.key = CACHE / "keys/cert.pem", CACHE / "keys/key.pem"
        print("image: signed with a development key; a plant's own: --cert, --key")
    programs = [options.build / "node/imprint-node", options.build / "firmware_config/imprint-board"]
    version = version_of_tree()
    kernel, grub, busybox = boot_parts(options.board)
    root, size_mb = make_root(work, kernel, busybox, options.board, programs, version, options.keyring or options.cert)
    board_files = work / "board_files"
    if options.config:
        checker = (options.build if options.board == "amd64" else ROOT / "build") / "firmware_config/imprint-board"  # of this machine
        run(checker, options.config / "board.toml", "--out", board_files, "--part", "boot")
    board_options = board_files / "boot/efi/grub/board.cfg"
    if not board_options.exists():
        board_options.parent.mkdir(parents=True, exist_ok=True)
        board_options.write_text('set board_options=""\n')
    name = f"imprint-{options.board}-{version}"
    make_disk(options.out / f"{name}.img", root, work, options.config, board_options, options.data_mb, options.board, grub)
    make_bundle(options.out / f"{name}.raucb", root, work, f"imprint-board-{options.board}", version, options.cert, options.key)
    make_thin(options.out / f"{name}.raucb", options.cert, options.key)
    shutil.move(work / "sbom.spdx", options.out / f"{name}.spdx")
    print(f"{options.out / name}.img, .raucb, .thin.raucb, .spdx: root {size_mb:.0f} MB, {root.stat().st_size / 1e6:.0f} MB on disk, "
          f"in {time.monotonic() - begin:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
