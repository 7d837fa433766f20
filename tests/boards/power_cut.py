#!/usr/bin/env python3
"""Power cut at random moments of the update that the test `update` has recorded, from its wish to the other slot judged good:
of each disk that it would have left the board boots to a publishing node. Half of the moments are times, half places in what
was written, for most of an update's time nothing is. Moments that leave the same disk share a board."""
import itertools
import os
import random
import sys
import time

import disk_log
import guest
import plant
import update

CUTS = int(os.environ.get("IMPRINT_POWER_CUTS", "20"))
SEED = int(os.environ.get("IMPRINT_SEED", str(int(time.time()))))


def choose(moments, dice):
    grown = [0] + [now.end - (before.end if now.log == before.log else 0) for before, now in itertools.pairwise(moments)]
    chosen = dice.choices(moments, k=CUTS - CUTS // 2) + dice.choices(moments, weights=grown, k=CUTS // 2)
    return sorted(chosen, key=lambda moment: moment.at_s)


def main(build):
    folder = guest.CACHE / "update"
    if not (folder / "recording.json").exists():
        print("there is no recorded update: ./dev test-boards update")
        return 1
    logs, moments = disk_log.load(folder / "recording.json")
    dice = random.Random(SEED)
    replay = disk_log.Replay(folder / "base.img", logs, dice)
    disk, console = folder / "cut.img", folder / "cut_console.log"
    console.unlink(missing_ok=True)
    print(f"seed of the cuts: {SEED}", flush=True)
    booted = {}  # by what is written on the disk: the number of the cut, and the version that came up
    with plant.Plant(build, folder, kept=True) as line:
        for number, moment in enumerate(choose(moments, dice)):
            cached, lost, written = replay.cut(moment, disk)
            what = f"power cut {number + 1}, {moment.at_s:.1f} s into the update, {lost} of {cached} writes in the disk's cache lost"
            if written in booted:
                print(f"ok   {what}: the same disk as cut {booted[written][0]}", flush=True)
                continue
            # One processor: emulated, a start takes a quarter less work than with two.
            with plant.Board(disk, console, processors=1) as board:
                def publishes():
                    state = line.firmware()
                    return state if state and line.camera() else None
                try:
                    state, took_s = plant.wait_for(publishes, update.BOOT_S, "a publishing node", board.running)
                except RuntimeError as error:
                    print(f"FAIL {what}: {error}\n{board.printed()[-3000:]}", flush=True)
                    return 1
            booted[written] = (number + 1, state["image_version"])
            print(f"ok   {what}: version {state['image_version']} from slot {state['slot']} publishes after {took_s:.0f} s", flush=True)
    versions = [version for _, version in booted.values()]
    print(f"{CUTS} cuts, {len(versions)} different disks: all boards booted, {versions.count('2')} of them the update")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
