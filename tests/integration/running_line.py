"""A running line of real processes over Zenoh on loopback, for the tests of this folder.

Meson passes the programs and the scene in the environment: IMPRINT, IMPRINT_NODE, IMPRINT_FUSION, IMPRINT_SCENE.
"""
import json
import os
import pathlib
import signal
import socket
import sqlite3
import subprocess
import tempfile
import time
import urllib.request

IMPRINT, NODE, FUSION, SCENE = (os.environ[name] for name in ("IMPRINT", "IMPRINT_NODE", "IMPRINT_FUSION", "IMPRINT_SCENE"))
SANITIZED_FACTOR = float(os.environ.get("IMPRINT_TEST_PATIENCE", "1"))  # sanitizer builds are slower
PATIENCE_S = 60 * SANITIZED_FACTOR  # a busy machine may take long; nothing here waits for it when all is well
CAMERAS = ("cam1", "cam2", "cam3")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def imprint(*arguments):
    return subprocess.run([IMPRINT, *map(str, arguments)], capture_output=True, text=True, timeout=2 * PATIENCE_S, check=False)


class Line:
    """Processes of one line in a folder of their own; all are gone when the block is left."""

    def __init__(self, work, rig, source, path, deadline_s=PATIENCE_S, retry_s=5.0):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=work))
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.page = free_port()
        self.processes = {}
        self.commands = {}
        self.fusion_config = self.write("fusion.toml", f"""
[fusion]
rig = "{rig}"
database = "imprint.db"
result_dir = "results"
deadline_s = {deadline_s}
[zenoh]
listen = ["{self.endpoint}"]
[page]
port = {self.page}
""")
        self.node_config = self.write("node.toml", f"""
[node]
camera_id = "cam1"
rig = "{rig}"
[capture]
source = "{source}"
path = "{path}"
[spool]
retry_s = {retry_s}
[zenoh]
connect = ["{self.endpoint}"]
[health]
period_s = 0.5
""")

    def write(self, name, text):
        (self.folder / name).write_text(text, encoding="utf-8")
        return self.folder / name

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill_all()

    def kill_all(self):
        for process in self.processes.values():
            process.kill()
        for process in self.processes.values():
            process.wait()
            if process.stdout:
                process.stdout.close()

    def start(self, name, command, environment=None):
        self.commands[name] = (command, environment)
        with open(self.folder / f"{name}.log", "ab") as log:
            self.processes[name] = subprocess.Popen([str(part) for part in command], stdout=log, stderr=log,
                                                    env={**os.environ, **(environment or {})})

    def start_again(self, name):
        self.start(name, *self.commands[name])

    def start_fusion(self, *arguments, **environment):
        self.start("fusion", [FUSION, "--config", self.fusion_config, *arguments], environment)

    def node_command(self, camera, **settings):
        command = [NODE, "--config", self.node_config, "--set", f"node.camera_id={camera}"]
        for key, value in settings.items():
            command += ["--set", f"{key.replace('__', '.')}={value}"]
        return command

    def start_nodes(self, *cameras, **settings):
        for camera in cameras:
            self.start(camera, self.node_command(camera, **settings))

    def end(self, name, with_signal):
        """Ends a process and gives its exit status and how long that took."""
        begin = time.monotonic()
        self.processes[name].send_signal(with_signal)
        return self.processes.pop(name).wait(PATIENCE_S), time.monotonic() - begin

    def status(self):
        done = imprint("status", "--connect", self.endpoint, "--timeout", PATIENCE_S, "--json")
        return json.loads(done.stdout) if done.returncode == 0 else None

    def wait_for(self, condition, what):
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            status = self.status()
            if status and condition(status):
                return status
            time.sleep(0.1)
        raise AssertionError(f"not within {PATIENCE_S} s: {what}\n{self.logs()}")

    def wait_alive(self, *cameras):
        return self.wait_for(lambda status: {c["id"] for c in status["cameras"] if c["alive"]} == set(cameras),
                             f"cameras {cameras} alive")

    def trigger(self, observation, expect, wait=True, session="S", rotation_deg=0.0, in_s=0):
        arguments = ["trigger", "--connect", self.endpoint, "--session", session, "--observation", observation,
                     f"--rotation-deg={rotation_deg}", "--expect", expect, "--in", in_s, "--json"]
        done = imprint(*arguments, *(["--wait", PATIENCE_S] if wait else []))
        if done.returncode != 0:
            raise AssertionError(f"trigger: {done.stderr}\n{self.logs()}")
        return json.loads(done.stdout)

    def watch(self, *arguments):
        watch = subprocess.Popen([IMPRINT, "watch", "--connect", self.endpoint, "--json", *map(str, arguments)],
                                 stdout=subprocess.PIPE)
        self.processes[f"watch {len(self.processes)}"] = watch
        return watch

    def result(self, session="S"):
        with urllib.request.urlopen(f"http://127.0.0.1:{self.page}/api/result/{session}", timeout=10) as answer:
            return json.load(answer)

    def logs(self):
        return "\n".join(f"--- {log.name}\n{log.read_text(errors='replace')}" for log in sorted(self.folder.glob("*.log")))

    def stored(self, query):
        """Rows of fusion's database, read beside it."""
        with sqlite3.connect(f"file:{self.folder / 'imprint.db'}?mode=ro", uri=True, timeout=10) as database:
            return database.execute(query).fetchall()
