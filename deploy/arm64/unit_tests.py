#!/usr/bin/env python3
"""Builds what a board runs, and the unit tests of that, in a cross-compiled build folder; runs the tests in qemu-user.

    unit_tests.py BUILD JOBS
"""
import json
import subprocess
import sys

PROGRAMS = ("node/imprint-node", "firmware_config/imprint-board")
TESTED = ("tests/unit/lib/", "tests/unit/node/", "tests/unit/firmware_config/")
PATIENCE = "20"  # an emulated test takes so many times as long, at most


def main(build, jobs):
    listed = json.loads(subprocess.run(["meson", "introspect", build, "--tests"], check=True, capture_output=True, text=True).stdout)
    names = {test["cmd"][0].removeprefix(f"{build}/"): test["name"] for test in listed}
    tests = {target: name for target, name in names.items() if target.startswith(TESTED)}
    subprocess.run(["ninja", "-C", build, "-j", jobs, *PROGRAMS, *tests], check=True)
    return subprocess.run(["meson", "test", "-C", build, "--no-rebuild", "--num-processes", jobs, "--timeout-multiplier", PATIENCE,
                           "--print-errorlogs", *tests.values()], check=False).returncode


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
