#!/usr/bin/env python3
"""A new board takes over a camera from a USB stick; an update comes from a stick too, and a camera's folder with a fault in
it changes nothing."""
import os
import pathlib
import shutil
import subprocess
import sys
import time

import guest
import plant
import update

import make_disk  # of deploy/image, whose place guest knows
import make_stick

SWAP_S = 900  # from switching on to a measured frame


def new_board(work, folder):
    """A disk as it is flashed, of no camera yet."""
    options = folder / "board.cfg"
    options.write_text('set board_options=""\n')
    make_disk.make_disk(folder / "disk.img", work / "root.squashfs", folder, None, options, 512)
    console = folder / "console.log"
    console.unlink(missing_ok=True)
    return plant.Board(folder / "disk.img", console)


def log_of(stick):
    done = subprocess.run(["mtype", "-i", stick, f"::{make_stick.LOG}"], capture_output=True, text=True, check=False)
    return done.stdout


def stick_command(build, *arguments):
    return subprocess.run([sys.executable, plant.ROOT / "deploy/image/make_stick.py", "--build", build, *map(str, arguments)],
                          capture_output=True, text=True, check=False)


def takes_over(cycle, build, folder):
    """A flashed board of no camera, and the stick of cam1."""
    stick = folder / "stick.img"
    made = stick_command(build, "--config", cycle.line.board_folder("cam1"), "--out", stick)
    cycle.check("a stick is made", made.returncode == 0, made.stderr.strip())
    begin = time.monotonic()
    cycle.board.start(stick)
    cycle.boots_and_measures()
    took_s = time.monotonic() - begin
    cycle.check("a new board with a stick takes over a camera in under 15 minutes", took_s < SWAP_S, f"{took_s:.0f} s")
    cycle.board.cut_power()
    cycle.check("the stick says what came of it", "this board is imprint-L1-cam1 now" in log_of(stick), log_of(stick).strip())


def updates_from_a_stick(cycle, build, folder):
    """A bundle beside a board.toml that names no camera."""
    stick, broken = folder / "stick2.img", folder / "broken"
    shutil.rmtree(broken, ignore_errors=True)
    shutil.copytree(folder / "board-cam1", broken)
    text = (broken / "board.toml").read_text()
    (broken / "board.toml").write_text(text.replace('camera_id = "cam1"\n', ""))
    refused = stick_command(build, "--config", broken, "--out", stick)
    cycle.check("a folder with a fault makes no stick", refused.returncode == 2 and "camera_id" in refused.stderr, refused.stderr.strip())
    make_stick.make_stick(stick, broken, cycle.bundles / "v2.raucb")
    cycle.board.start(stick)

    def good():
        state = cycle.line.firmware()
        return state if state and state["image_version"] == "2" and state["slot_good"] else None
    state, took_s = plant.wait_for(good, 2 * update.BOOT_S, "version 2 judged good", cycle.board.running)
    cycle.check("an update comes from a stick", state["slot"] == "B", f"{took_s:.0f} s")
    cycle.board.cut_power()
    log = log_of(stick)
    cycle.check("a board.toml with a fault changes nothing, and the stick says why", "refused" in log and "camera_id" in log, log.strip())


def main(build):
    if os.geteuid() != 0:
        print("needs root, to make a root file system")
        return 1
    build = pathlib.Path(build).resolve()
    folder = guest.CACHE / "swap"
    folder.mkdir(parents=True, exist_ok=True)
    work = update.prepare(build / "image")
    line = plant.Plant(build, folder)
    with line:
        board = new_board(work, folder)
        cycle = update.Cycle(line, board, work)
        try:
            takes_over(cycle, build, folder)
            updates_from_a_stick(cycle, build, folder)
        except RuntimeError as error:
            cycle.check(str(error), False)
        finally:
            board.cut_power()
        if cycle.faults:
            print(board.printed()[-3000:])
    return 1 if cycle.faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
