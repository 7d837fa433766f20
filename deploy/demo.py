#!/usr/bin/env python3
"""./dev demo [FOLDER]: the whole system on one machine, as separate processes talking over Zenoh.

Renders three observations of the forge scene (or takes FOLDER with a session.toml of your own), starts the fusion node and
one node a camera, triggers every observation, prints the measured forging (beside the truth where there is one) and stops
everything it started.
"""
import argparse
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
BIN = ROOT / "build" / "bin"
START_TIMEOUT_S = 30
RESULT_TIMEOUT_S = 120


def fail(message, status=2):
    """Ends the demo with one line: status 2 for what was asked for, 1 for a job that could not be done."""
    print(f"demo: {message}", file=sys.stderr)
    sys.exit(status)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def imprint(*arguments):
    return subprocess.run([str(BIN / "imprint"), *map(str, arguments)], capture_output=True, text=True, check=False)


class Plant:
    """The processes of one line; leaving the context stops them all."""

    def __init__(self, folder, rig, cameras):
        self.folder, self.cameras = folder, cameras
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.page = f"http://127.0.0.1:{free_port()}/"
        self.rig = rig
        self.processes = {}

    def start(self, name, program, template, **settings):
        log = open(self.folder / f"{name}.log", "w", encoding="utf-8")
        command = [str(BIN / program), "--config", str(template)]
        for key, value in settings.items():
            command += ["--set", f"{key.replace('__', '.')}={value}"]
        self.processes[name] = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)

    def __enter__(self):
        self.start("fusion", "imprint-fusion", ROOT / "deploy" / "fusion.toml", fusion__rig=f'"{self.rig}"',
                   fusion__database=f'"{self.folder / "fusion.sqlite"}"', fusion__result_dir=f'"{self.folder / "results"}"',
                   zenoh__listen=f'["{self.endpoint}"]', fusion__deadline_s=60.0, page__port=self.page.rsplit(":", 1)[1].strip("/"))
        for camera in self.cameras:
            self.start(camera, "imprint-node", ROOT / "firmware_config" / "node.toml", node__camera_id=f'"{camera}"',
                       node__rig=f'"{self.rig}"', capture__source='"session"', capture__path=f'"{self.folder / "session.toml"}"',
                       node__data_dir=f'"{self.folder / "nodes"}"', zenoh__connect=f'["{self.endpoint}"]')
        return self

    def __exit__(self, *_):
        for process in self.processes.values():
            process.send_signal(signal.SIGTERM)
        for process in self.processes.values():
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()

    def wait_until_alive(self):
        deadline = time.monotonic() + START_TIMEOUT_S
        while time.monotonic() < deadline:
            for name, process in self.processes.items():
                if process.poll() is not None:
                    log = (self.folder / f"{name}.log").read_text(encoding="utf-8", errors="replace").split("\n")
                    said = next((line for line in reversed(log) if line.strip()), "nothing")
                    fail(f"{name} ended with status {process.returncode} and said: {said}", 1)
            status = imprint("status", "--connect", self.endpoint, "--json")
            if status.returncode == 0 and alive_cameras(json.loads(status.stdout)) >= set(self.cameras):
                return
            time.sleep(0.2)
        fail(f"not all cameras came up within {START_TIMEOUT_S} s; the logs are in {self.folder}", 1)

    def measure(self, session, rotations):
        """Triggers every observation and gives the last result."""
        for index, rotation in enumerate(rotations):
            begin = time.monotonic()
            done = imprint("trigger", "--connect", self.endpoint, "--session", session, "--observation", index,
                           f"--rotation-deg={rotation}", "--expect", len(rotations), "--wait", RESULT_TIMEOUT_S, "--json")
            if done.returncode:
                fail(f"observation {index}: {done.stderr.strip()}; the logs are in {self.folder}", 1)
            print(f"  observation {index} at {rotation:g} deg: trigger to result {time.monotonic() - begin:.2f} s", flush=True)
        return done.stdout


def alive_cameras(status):
    return {camera["id"] for camera in status["cameras"] if camera["alive"]}


def render(folder, seed):
    print(f"Rendering three observations of the forge scene into {folder} ...", flush=True)
    command = [str(BIN / "imprint"), "simulate", str(ROOT / "simulation" / "scenes" / "forge.toml"), "--seed", str(seed),
               "--observations", "3", "--jobs", "2", "--out", str(folder)]
    # The progress bar is on stderr; the advice what to do with the frames is for those who only render.
    if subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode:
        fail("rendering failed", 1)


def wait_for_enter(page):
    print(f"The page is up at {page} - press Enter to stop", flush=True)
    sys.stdin.readline()


def read_session(folder):
    """The rig's path, its cameras and the rotations of FOLDER/session.toml; what the programs check is left to them."""
    file = folder / "session.toml"
    try:
        session = tomllib.loads(file.read_text(encoding="utf-8"))
        file = (folder / session["rig"]).resolve()
        cameras = [camera["id"] for camera in tomllib.loads(file.read_text(encoding="utf-8"))["camera"]]
        return file, cameras, [float(observation.get("rotation_deg", 0.0)) for observation in session["observation"]]
    except (OSError, ValueError) as error:  # ValueError: no TOML, no text, no number
        fail(f"{file}: {error}")
    except (KeyError, TypeError, AttributeError) as error:
        fail(f"{file}: expected what docs/interfaces.md describes; missing or of another kind: {error}")


def main():
    parser = argparse.ArgumentParser(prog="./dev demo", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=pathlib.Path, help="holds a session.toml (and perhaps a truth.json)")
    parser.add_argument("--seed", type=int, default=1, help="of the rendered forging")
    parser.add_argument("--hold", action="store_true", help="keep the page up until Enter is pressed")
    options = parser.parse_args()
    source = options.folder.resolve() if options.folder else ROOT / "demo" / f"forge-{options.seed}"
    if options.folder and not (source / "session.toml").is_file():
        fail(f"{source}: holds no session.toml; see docs/own_images.md")
    if not (source / "session.toml").is_file():
        render(source, options.seed)
    if not os.access(source, os.W_OK):
        fail(f"{source}: result, report and logs are written there, but it is read-only; copy it elsewhere")
    rig, cameras, rotations = read_session(source)

    print(f"Starting imprint-fusion and {len(cameras)} imprint-node ...", flush=True)
    name = f"{source.name}-{time.strftime('%Y%m%dT%H%M%S')}"
    with Plant(source, rig, cameras) as plant:
        plant.wait_until_alive()
        print(f"  page: {plant.page}" + ("" if options.hold else " (while this runs; --hold keeps it up)"), flush=True)
        print("  measuring; three nodes and fusion share this machine, so an observation takes some seconds", flush=True)
        result = plant.measure(name, rotations)
        result_file = source / "result.json"
        result_file.write_text(json.dumps(json.loads(result), indent=1) + "\n", encoding="utf-8")
        report_file = source / "report.html"
        arguments = ["report", result_file, "--out", report_file]
        if (source / "truth.json").is_file():
            arguments += ["--truth", source / "truth.json"]
        report = imprint(*arguments)
        if report.returncode:
            fail(report.stderr.strip(), 1)
        print(report.stdout, end="")
        print(f"Result: {result_file}\nReport: {report_file} (to read and print in any browser)\nLogs:   {source}/*.log")
        print(f"The same without a line: build/bin/imprint measure {source / 'session.toml'}")
        if options.hold:
            wait_for_enter(plant.page)
    print("All processes stopped.")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:  # leaving the context has stopped the processes
        sys.exit("\ndemo: interrupted; all processes stopped")
