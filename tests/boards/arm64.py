#!/usr/bin/env python3
"""The arm64 image under UEFI in QEMU boots to a publishing node. Not among those that run without being named: the image is
another build, ./dev image --board arm64."""
import pathlib
import sys

import guest
import plant
import update


def main(build):
    build = pathlib.Path(build).resolve()
    work, folder = build / "image/work-arm64", guest.CACHE / "arm64/board"
    if not (work / "root.squashfs").exists():
        print("there is no arm64 image: ./dev image --board arm64")
        return 1
    folder.mkdir(parents=True, exist_ok=True)
    line = plant.Plant(build, folder)
    board = update.make_board(line, work, folder, "arm64", guest.CACHE / "arm64/boot/usr/lib/grub")
    cycle = update.Cycle(line, board, work)
    with line, board:
        try:
            cycle.boots_and_measures()
        except RuntimeError as error:
            cycle.check(str(error), False)
        if cycle.faults:
            print(board.printed()[-3000:])
    return 1 if cycle.faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
