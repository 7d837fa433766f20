#!/usr/bin/env python3
"""Counts test cases from the runners' own closing lines in Meson's log; the last line is "N passed, N failed".

A runner that closes without such a line counts by its exit status, so that nothing that ran is left out.
"""
import json
import re
import sys

CATCH_ALL = re.compile(r"All tests passed \(.* in (\d+) test cases?\)")
CATCH_SOME = re.compile(r"^test cases: +\d+ \|(.*)$", re.M)
UNITTEST = re.compile(r"^Ran (\d+) tests? in", re.M)
UNITTEST_FAILED = re.compile(r"FAILED \(([^)]*)\)")


def count(entry):
    """(passed, failed) of one runner."""
    text = entry.get("stdout", "") + entry.get("stderr", "")
    good = entry["result"] == "OK"
    passed = failed = 0
    for found in CATCH_ALL.finditer(text):
        passed += int(found.group(1))
    for found in CATCH_SOME.finditer(text):
        passed += sum(map(int, re.findall(r"(\d+) passed", found.group(1))))
        failed += sum(map(int, re.findall(r"(\d+) failed(?! as expected)", found.group(1))))
    ran = sum(map(int, UNITTEST.findall(text)))
    unlucky = sum(int(n) for part in UNITTEST_FAILED.findall(text) for n in re.findall(r"(?:failures|errors)=(\d+)", part))
    passed, failed = passed + ran - unlucky, failed + unlucky
    if not good and failed == 0:
        failed = 1  # crashed, timed out, or failed outside its own counting
    if good and passed == 0:
        passed = 1
    return passed, failed


def main():
    log, status = sys.argv[1], int(sys.argv[2])
    with open(log, encoding="utf-8") as lines:
        entries = [json.loads(line) for line in lines if line.strip()]
    totals = [0, 0]
    for entry in entries:
        for i, n in enumerate(count(entry)):
            totals[i] += n
    if status and not totals[1]:
        totals[1] = 1
    if not entries:
        print("no test was run", file=sys.stderr)
        totals[1] += 1
    print(f"{totals[0]} passed, {totals[1]} failed")
    return 1 if totals[1] else 0


if __name__ == "__main__":
    sys.exit(main())
