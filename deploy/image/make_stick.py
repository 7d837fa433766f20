#!/usr/bin/env python3
"""./dev stick: a USB stick that makes a board another camera, or brings it an update."""
import argparse
import pathlib
import subprocess
import sys

from kernel_package import run

ROOT = pathlib.Path(__file__).resolve().parents[2]
LABEL = "IMPRINT"  # what a board looks for
LOG = "imprint-board.log"  # what the board writes
PARTS = ("board.toml", "identity", "rig")
ROOM_MB = 8  # for the board's log


def parse():
    parser = argparse.ArgumentParser(prog="./dev stick", description=__doc__)
    parser.add_argument("--config", type=pathlib.Path, help="the camera's folder: board.toml, identity/ and rig/")
    parser.add_argument("--bundle", type=pathlib.Path, help="the .raucb to install")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="the stick (/dev/sdX: what is on it is lost), or a file")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build")
    return parser.parse_args()


def refuse(message):
    print(f"stick: {message}", file=sys.stderr)
    return 2


def megabytes(path):
    files = [path] if path.is_file() else [file for file in path.rglob("*") if file.is_file()]
    return sum(file.stat().st_size + 4096 for file in files) / 1e6


def is_removable(device):
    flag = pathlib.Path("/sys/class/block") / device.name / "removable"
    return flag.exists() and flag.read_text().strip() == "1"


def make_stick(out, config, bundle):
    """A FAT file system labelled IMPRINT on a device or in a file, without a partition table."""
    contents = [config / part for part in PARTS] if config else []
    contents += [bundle] if bundle else []
    if not out.is_block_device():
        out.unlink(missing_ok=True)
        size_mb = int(sum(map(megabytes, contents)) * 1.02) + ROOM_MB + 34  # FAT32 begins at 33 MB
        run("truncate", "-s", f"{size_mb}M", out)
    run("mkfs.vfat", "-I", "-F", "32", "-n", LABEL, out, capture_output=True)
    run("mcopy", "-s", "-i", out, *contents, "::")


def main():
    options = parse()
    if not options.config and not options.bundle:
        return refuse("expected --config, --bundle or both")
    if options.out.is_block_device() and not is_removable(options.out):
        return refuse(f"{options.out} is no removable disk")
    for file in [options.config / part for part in (*PARTS, "identity/key.pem")] if options.config else []:
        if not file.exists():
            return refuse(f"{file} is missing (identity/: imprint certs issue; all three: docs/boards.md)")
    if options.bundle and not options.bundle.is_file():
        return refuse(f"{options.bundle} is missing")
    if options.config:
        checked = subprocess.run([options.build / "firmware_config/imprint-board", options.config / "board.toml"],
                                 capture_output=True, text=True, check=False)
        if checked.returncode != 0:
            return refuse(checked.stderr.strip())
    make_stick(options.out, options.config, options.bundle)
    print(f"{options.out}: put it into the board; what came of it is then in {LOG} on it")
    return 0


if __name__ == "__main__":
    sys.exit(main())
