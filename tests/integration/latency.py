#!/usr/bin/env python3
"""latency.py FOLDER: from trigger to stored result, with ready imprints in place of the nodes' image work.

What a client on the line sees: it publishes a trigger and waits for the result, which fusion announces once it is on disk.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys

import soak  # noqa: F401: sets the programs' places in the environment
import python_environment
from ready_imprints import ReadyImprints, ReadyLine
from running_line import CAMERAS

HERE = pathlib.Path(__file__).resolve().parent
GOAL_MEDIAN_MS, GOAL_P99_MS = 150, 400


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--observations", type=int, default=100)
    options = parser.parse_args()
    python = python_environment.ensure(os.environ["IMPRINT_PYTHON"], HERE / "requirements.txt")
    ready = ReadyImprints(options.folder)
    with ReadyLine(options.folder, ready) as line:
        line.start_fusion()
        line.start_nodes(*CAMERAS)
        line.wait_alive(*CAMERAS)
        done = subprocess.run([python, HERE / "latency_client.py", line.endpoint, str(options.observations)], stdout=subprocess.PIPE,
                              text=True, check=True)
        times_ms = json.loads(done.stdout)
        fuse_ms = fusing_times_ms((line.folder / "fusion.log").read_text(encoding="utf-8"))
    percentile_ms = statistics.quantiles(times_ms, n=100)[98]
    print(f"trigger to stored result, {len(times_ms)} observations of three cameras: median {statistics.median(times_ms):.0f} ms "
          f"(goal {GOAL_MEDIAN_MS}), 99th percentile {percentile_ms:.0f} ms (goal {GOAL_P99_MS}); "
          f"of which from the last imprint to the stored result: median {statistics.median(fuse_ms):.0f} ms")
    return 0


def fusing_times_ms(log):
    """From fusion's log: between the last imprint of a session and its result."""
    last, times = {}, []
    for line in log.splitlines():
        words = line.split()
        if "session" not in words:
            continue
        moment = sum(float(part) * factor for part, factor in zip(words[0].split("T")[1].split(":"), (3_600_000, 60_000, 1000)))
        session = words[words.index("session") + 1].rstrip(":")
        if "imprint of" in line:
            last[session] = moment
        elif "stored" in line and session in last:
            times.append(moment - last[session])
    return times


if __name__ == "__main__":
    sys.exit(main())
