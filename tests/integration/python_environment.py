"""The Python environment of the independent client: made once below .cache/, made anew when its pins change."""

import fcntl
import pathlib
import subprocess
import sys


def ensure(folder, requirements):
    """Path of the environment's python. Ends the program with one line when it cannot be made."""
    folder = pathlib.Path(folder)
    wanted = pathlib.Path(requirements).read_text(encoding="utf-8")
    stamp = folder / "requirements.txt"
    folder.parent.mkdir(parents=True, exist_ok=True)
    with open(folder.with_suffix(".lock"), "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # tests may run at the same time
        if not stamp.exists() or stamp.read_text(encoding="utf-8") != wanted:
            run("make a virtual environment (is python3-venv installed?)",
                [sys.executable, "-m", "venv", "--clear", str(folder)])
            run("install the packages of " + str(requirements) + " (is the package index reached?)",
                [str(folder / "bin" / "pip"), "install", "--quiet", "--requirement", str(requirements)])
            stamp.write_text(wanted, encoding="utf-8")
    return str(folder / "bin" / "python")


def run(what, command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode:
        last = done.stdout.strip().splitlines()[-1:] or ["no output"]
        sys.exit(f"python environment: cannot {what}: {last[0]}")
