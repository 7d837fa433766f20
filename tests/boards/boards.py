#!/usr/bin/env python3
"""Runs the tests of boards, two at a time for emulated machines wait a lot: ./dev test-boards [NAME...]. The last line counts them."""
import os
import pathlib
import subprocess
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
LANES = (("update", "power_cut"), ("vivid", "gige", "libcamera", "memory", "host", "swap"))  # in a lane one after the other
NAMED = ("arm64",)  # only when named


def run(name, build):
    """Whether it passed; what it prints comes line by line, behind its name."""
    begin = time.monotonic()
    test = subprocess.Popen([sys.executable, "-u", HERE / f"{name}.py", build], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            errors="replace")
    for line in test.stdout:
        print(f"{name}: {line}", end="", flush=True)
    _, status, used = os.wait4(test.pid, 0)
    test.returncode = os.waitstatus_to_exitcode(status)
    print(f"== {name}: {'failed' if status else 'passed'} in {time.monotonic() - begin:.0f} s, "
          f"{used.ru_utime + used.ru_stime:.0f} s of a processor", flush=True)
    return status == 0


def main(build, names):
    known = [name for lane in LANES for name in lane] + list(NAMED)
    unknown = [name for name in names if name not in known]
    if unknown:
        print(f"no test of boards is called {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    begin = time.monotonic()
    passed = {}

    def run_lane(lane):
        for name in lane:
            passed[name] = run(name, build)
    lanes = [[name for name in lane if name in names or not names] for lane in LANES]
    lanes.append([name for name in NAMED if name in names])
    threads = [threading.Thread(target=run_lane, args=(lane,)) for lane in lanes if lane]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    failed = [name for name in passed if not passed[name]]
    print(f"{len(passed) - len(failed)} passed, {len(failed)} failed{': ' if failed else ''}{', '.join(failed)} in {time.monotonic() - begin:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
