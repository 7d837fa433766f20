#!/usr/bin/env python3
"""Runs the tests of boards one after the other: ./dev test-boards [NAME...]. The last line counts them."""
import sys
import time

import arm64
import gige
import host
import libcamera
import memory
import power_cut
import swap
import update
import vivid

TESTS = {"vivid": vivid.main, "gige": gige.main, "libcamera": libcamera.main, "memory": memory.main,
         "host": host.main, "update": update.main, "power_cut": power_cut.main, "swap": swap.main}
NAMED = {"arm64": arm64.main}  # only when named


def main(build, names):
    known = TESTS | NAMED
    unknown = [name for name in names if name not in known]
    if unknown:
        print(f"no test of boards is called {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    failed = []
    for name in names or TESTS:
        begin = time.monotonic()
        print(f"== {name}", flush=True)
        try:
            status = known[name](build)
        except Exception as error:  # one that cannot even run has failed; the others still tell something
            print(f"{name}: {error}")
            status = 1
        print(f"== {name}: {'failed' if status else 'passed'} in {time.monotonic() - begin:.0f} s", flush=True)
        if status:
            failed.append(name)
    count = len(names or TESTS)
    print(f"{count - len(failed)} passed, {len(failed)} failed" + (f": {', '.join(failed)}" if failed else ""))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
