#!/usr/bin/env python3
"""./dev soak [NAME...]: the fault suite with full counts. Prints each fault's figures and writes the table of all of them
to build/soak.md; docs/reliability.md holds that of the last full run. Needs root for cable, loss and disk.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BIN = ROOT / "build" / "bin"
for variable, value in (("IMPRINT", BIN / "imprint"), ("IMPRINT_NODE", BIN / "imprint-node"), ("IMPRINT_FUSION", BIN / "imprint-fusion"),
                        ("IMPRINT_SCENE", ROOT / "tests" / "data" / "small_forge.toml"), ("IMPRINT_PYTHON", ROOT / ".cache" / "venv"),
                        ("IMPRINT_CLOCK_SHIFT", ROOT / "build" / "tests" / "integration" / "libclock_shift.so")):
    os.environ.setdefault(variable, str(value))

import faults  # noqa: E402: reads the environment
import python_environment  # noqa: E402
from ready_imprints import ReadyImprints  # noqa: E402

FUZZ_S = 600


def fuzz(program, *arguments):
    """Ten minutes of inputs nobody would send; a finding ends the program, and lies where it says."""
    def run(work, _ready, _python):
        done = subprocess.run([ROOT / "build" / "tests" / "fuzz" / program, *arguments, "--seconds", str(FUZZ_S)], cwd=work,
                              capture_output=True, text=True, check=False)
        if done.returncode:
            for finding in pathlib.Path(work).glob("finding-*"):
                finding.replace(ROOT / "build" / finding.name)
            raise AssertionError(f"a finding, kept in build/: {done.stderr.strip()}")
        return {"said": done.stdout.strip()}
    return run


FAULTS = {
    "kills": lambda work, ready, python: faults.kills(work, ready, python, observations=200, kill_count=50),
    "cut-2s": lambda work, ready, _: faults.cable_cut(work, ready, cut_s=2, observations=5),
    "cut-20s": lambda work, ready, _: faults.cable_cut(work, ready, cut_s=20, observations=12),
    "cut-50s": lambda work, ready, _: faults.cable_cut(work, ready, cut_s=50, observations=8),
    "loss-5": lambda work, ready, _: faults.packet_loss(work, ready, percent=5, observations=50),
    "loss-20": lambda work, ready, _: faults.packet_loss(work, ready, percent=20, observations=20),
    "thin-link": lambda work, ready, _: faults.thin_link(work, ready, minutes=10),
    "node-disk": lambda work, ready, _: faults.node_disk_full(work, ready),
    "fusion-disk": lambda work, ready, _: faults.fusion_disk_full(work, ready),
    "clocks": lambda work, ready, _: faults.clock_jumps(work, ready),
    "hostile": lambda work, ready, python: faults.hostile_client(work, ready, python, messages=100_000),
    "day": lambda work, ready, _: faults.day(work, ready, observations=480, pace_s=1.8),
    "fuzz-wire": fuzz("wire_fuzz"),
    **{f"fuzz-{kind}": fuzz("file_fuzz", kind) for kind in ("config", "library", "field", "session", "rig", "access")},
    "fuzz-http": fuzz("http_fuzz"),
}


def main():
    parser = argparse.ArgumentParser(prog="./dev soak", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="*", help=f"of: {', '.join(FAULTS)}; all without")
    names = parser.parse_args().name or list(FAULTS)
    if unknown := set(names) - set(FAULTS):
        parser.error(f"no fault named {', '.join(sorted(unknown))}")
    python = python_environment.ensure(os.environ["IMPRINT_PYTHON"], ROOT / "tests" / "integration" / "requirements.txt")
    table, failed = ["| fault | outcome | figures | time |", "|---|---|---|---|"], False
    with tempfile.TemporaryDirectory(prefix="imprint-soak-") as work:
        ready = ReadyImprints(work)
        for name in names:
            begin = time.monotonic()
            try:
                figures, outcome = FAULTS[name](work, ready, python), "held"
            except (AssertionError, OSError) as error:
                figures, outcome, failed = {"why": str(error).splitlines()[0] if str(error) else "see the log"}, "FAILED", True
                print(error, file=sys.stderr)
            text = ", ".join(f"{key} {value}" for key, value in figures.items())
            table.append(f"| {name} | {outcome} | {text} | {time.monotonic() - begin:.0f} s |")
            print(table[-1], flush=True)
    if set(names) == set(FAULTS):
        (ROOT / "build" / "soak.md").write_text("\n".join(table) + "\n", encoding="utf-8")
    return failed


if __name__ == "__main__":
    sys.exit(main())
