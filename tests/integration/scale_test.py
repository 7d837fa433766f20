"""More than one line: several in one fusion process, and two fusion processes behind one router."""
import contextlib
import json
import os
import pathlib
import shutil
import sqlite3
import tempfile
import time
import unittest

import python_environment
from ready_imprints import ReadyImprints, ReadyLine
from running_line import CAMERAS, PATIENCE_S, free_port, imprint

HERE = pathlib.Path(__file__).resolve().parent
work = ready = python = None


def setUpModule():
    global work, ready, python
    work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-scale-"))
    unittest.addModuleCleanup(shutil.rmtree, work, ignore_errors=True)
    python = python_environment.ensure(os.environ["IMPRINT_PYTHON"], HERE / "requirements.txt")
    ready = ReadyImprints(work)


class Plant(ReadyLine):
    """Lines with the same camera names: what belongs together is known by the line alone."""

    def start_camera(self, line, camera):
        self.start(f"{line} {camera}", self.node_command(camera, node__line=line, node__data_dir=f'"data-{line}"'))

    def ask(self, *command, line):
        done = imprint(*command, "--connect", self.endpoint, "--line", line)
        if done.returncode != 0:
            raise AssertionError(f"{line}: {done.stderr}\n{self.logs()}")
        return done.stdout

    def measure(self, line, session):
        self.ask("trigger", "--session", session, "--expect", 1, "--wait", PATIENCE_S, "--rotation-deg", ready.rotations[0], line=line)

    def wait_connected(self, line, cameras):
        until = time.monotonic() + PATIENCE_S
        while {c["id"] for c in json.loads(self.ask("status", "--timeout", PATIENCE_S, "--json", line=line))["cameras"] if c["alive"]} != set(cameras):
            if time.monotonic() > until:
                raise AssertionError(f"{line}: not all of {cameras} connected\n{self.logs()}")
            time.sleep(0.1)

    def results(self, database):
        with contextlib.closing(sqlite3.connect(f"file:{self.folder / database}?mode=ro", uri=True)) as opened:
            return opened.execute("SELECT session, complete, json_extract(result.json, '$.line'), "
                                  "(SELECT count(*) FROM json_each(result.json, '$.observations[0].cameras') "
                                  "WHERE json_extract(value, '$.excluded') = 0) FROM result ORDER BY session").fetchall()


class ScaleTest(unittest.TestCase):
    def test_eight_cameras_on_four_lines_with_one_fusion_process(self):
        rig = ready.rig.with_name("two_cameras.toml")
        third = '[[camera]]\nid = "cam3"\ncalibration = "cam3.toml"\n'
        self.assertIn(third, ready.rig.read_text())
        rig.write_text(ready.rig.read_text().replace(third, ""), encoding="utf-8")
        lines, cameras = ("L1", "L2", "L3", "L4"), CAMERAS[:2]
        with Plant(work, ready) as plant:
            for line in lines[1:]:
                plant.write(f"{line}.toml", f'[fusion]\nline = "{line}"\nrig = "{rig}"\ndatabase = "{line}.db"\n[page]\nport = {free_port()}\n')
            further = ", ".join(f'"{line}.toml"' for line in lines[1:])
            plant.start_fusion("--set", f'fusion.rig="{rig}"', "--set", "fusion.database=L1.db", "--set", f"fusion.lines=[{further}]")
            for line in lines:
                for camera in cameras:
                    plant.start_camera(line, camera)
            for line in lines:
                plant.wait_connected(line, cameras)
            for session in ("first", "second"):  # of the same name on every line
                for line in lines:
                    plant.measure(line, session)
            for line in lines:
                self.assertEqual(plant.results(f"{line}.db"), [(session, 1, f"plant/{line}", 2) for session in ("first", "second")])

    def test_two_fusion_processes_behind_a_router_each_have_their_own_line(self):
        with Plant(work, ready) as plant:
            plant.start("router", [python, HERE / "zenoh_router.py", plant.endpoint])
            for line in ("L1", "L2"):
                plant.start(f"fusion {line}", [os.environ["IMPRINT_FUSION"], "--config", plant.fusion_config, "--set", f"fusion.line={line}",
                                               "--set", f"fusion.database={line}.db", "--set", f"page.port={free_port()}",
                                               "--set", "zenoh.listen=[]", "--set", f'zenoh.connect=["{plant.endpoint}"]',
                                               "--set", f'fusion.result_dir="results-{line}"'])
                for camera in CAMERAS:
                    plant.start_camera(line, camera)
            for line in ("L1", "L2"):
                plant.wait_connected(line, CAMERAS)
            for line in ("L1", "L2", "L1"):
                plant.measure(line, f"{line}-{len(list(plant.folder.glob('results-*/*')))}")
            self.assertEqual(plant.results("L1.db"), [("L1-0", 1, "plant/L1", 3), ("L1-2", 1, "plant/L1", 3)])
            self.assertEqual(plant.results("L2.db"), [("L2-1", 1, "plant/L2", 3)])

    def test_lines_that_cannot_be_told_apart_are_refused(self):
        with Plant(work, ready) as plant:
            twin = f'[fusion]\nrig = "{ready.rig}"\ndatabase = "twin.db"\n'
            for text, complaint in ((twin, "plant/L1 is there twice"), (twin + 'line = "L2"\n[zenoh]\nlisten = []\n', "zenoh: expected in the program's own"),
                                    (twin + 'line = "L2"\nlines = ["a.toml"]\n', "fusion.lines: expected in the program's own")):
                plant.write("L2.toml", text)
                plant.start_fusion("--check", "--set", 'fusion.lines=["L2.toml"]')
                self.assertEqual(plant.processes.pop("fusion").wait(PATIENCE_S), 2)
                self.assertIn(complaint, plant.logs())


if __name__ == "__main__":
    unittest.main(verbosity=2)
