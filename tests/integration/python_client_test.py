#!/usr/bin/env python3
"""Runs python_client.py against the C++ publisher of a known imprint. Fails, never skips."""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import python_environment

HERE = pathlib.Path(__file__).resolve().parent


def client(python, announced, generated, expect, timeout_s):
    command = [python, str(HERE / "python_client.py"), "--connect", announced["endpoint"], "--key", announced["key"],
               "--generated", generated, "--expect", str(expect), "--timeout-s", str(timeout_s)]
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120, check=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--publisher", required=True, help="the program that publishes the known imprint")
    parser.add_argument("--protoc", required=True)
    parser.add_argument("--proto", required=True, type=pathlib.Path, help="imprint.proto")
    parser.add_argument("--environment", required=True, help="folder of the Python environment")
    args = parser.parse_args()

    python = python_environment.ensure(args.environment, HERE / "requirements.txt")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([args.protoc, f"--proto_path={args.proto.parent}", f"--python_out={folder}", str(args.proto)],
                       check=True)
        expect = pathlib.Path(folder) / "expect.json"
        # The publisher writes what it sends, then one JSON line with endpoint and key; it ends with its stdin.
        with subprocess.Popen([args.publisher, str(expect)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              text=True) as publisher:
            announced = json.loads(publisher.stdout.readline())
            good = client(python, announced, folder, expect, 20)
            # The same with one point moved by 0.01 px must be noticed, or the test says nothing.
            moved = json.loads(expect.read_text(encoding="utf-8"))
            moved["curves"]["axis"]["offset_px"][250] += 0.01
            expect.write_text(json.dumps(moved), encoding="utf-8")
            bad = client(python, announced, folder, expect, 20)
            publisher.stdin.close()
    print(good.stdout, end="")
    if good.returncode or publisher.returncode:
        sys.exit("the independent client did not find what was sent")
    if bad.returncode != 1 or "axis[250]: expected" not in bad.stdout:
        sys.exit(f"the independent client did not notice a moved point: {bad.stdout}")


if __name__ == "__main__":
    main()
