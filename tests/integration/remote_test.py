"""Service from afar: status, log, peek, settings and bundle of a line that looks at rendered pictures."""
import gzip
import json
import pathlib
import shutil
import signal
import subprocess
import tempfile
import unittest
import urllib.request

import running_line
from running_line import IMPRINT, PATIENCE_S, SCENE, imprint

work = data = None


def setUpModule():
    global work, data
    work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-remote-"))
    unittest.addModuleCleanup(shutil.rmtree, work, ignore_errors=True)
    data = work / "session"
    subprocess.run([IMPRINT, "simulate", SCENE, "--observations", "1", "--out", data], check=True, stdout=subprocess.DEVNULL)


class RemoteTest(unittest.TestCase):
    def setUp(self):
        self.line = running_line.Line(work, data / "rig.toml", "folder", data)
        self.addCleanup(self.line.kill_all)
        self.line.start_fusion()
        self.line.start_nodes("cam1", health__housing_temperature='"simulated"')
        self.line.wait_alive("cam1")

    def ask(self, *arguments, status=0):
        done = imprint(*arguments, "--connect", self.line.endpoint)
        self.assertEqual(done.returncode, status, done.stderr + self.line.logs())
        return done.stdout if status == 0 else done.stderr

    def test_peek_log_and_bundle(self):
        self.assertIn("no frame was taken", self.ask("peek", "cam1", status=1))
        self.line.trigger(0, 1, wait=False)
        self.line.wait_for(lambda status: status["cameras"][0]["last_imprint"], "an imprint")
        picture = self.line.folder / "peek.jpg"
        for options in ((), ("--region", "10,10,200,100"), ("--bytes", "2000", "--stretch")):
            about = json.loads(self.ask("peek", "cam1", *options, "--out", picture, "--json"))
            self.assertEqual(picture.read_bytes()[:3], b"\xff\xd8\xff")
            self.assertLessEqual(about["bytes"], 3600)
        self.assertEqual(json.loads(self.ask("peek", "cam1", "--region", "10,10,200,100", "--out", picture, "--json"))["x_px"], 10)
        self.assertIn("not seen in the last frame", self.ask("peek", "cam1", "--target", "99999", status=1))
        self.assertIn("imprint sent", self.ask("log", "cam1"))
        self.assertIn("imprint of cam1 taken", self.ask("log"))
        self.assertEqual(len(self.ask("log", "cam1", "--lines", "1").splitlines()), 1)
        self.assertIn("nobody answered", self.ask("log", "cam9", "--timeout", "1", status=1))
        bundle = self.line.folder / "bundle.json.gz"
        self.ask("bundle", "cam1", "--out", bundle)
        document = json.loads(gzip.decompress(bundle.read_bytes()))
        self.assertEqual(document["node"]["camera"], "cam1")
        self.assertIn("imprint sent", document["log"])

    def test_settings_are_checked_tried_and_kept(self):
        self.assertEqual(self.ask("config", "get", "cam1", "exposure.auto").strip(), "true")
        before = self.line.status()["cameras"][0]["health"]["boot_id"]
        self.assertIn("exposure.atuo", self.ask("config", "set", "cam1", "exposure.atuo=false", status=1))
        self.assertIn("cannot be set from afar", self.ask("config", "set", "cam1", "node.camera_id=cam2", status=1))
        self.assertIn("would do", self.ask("config", "set", "cam1", "exposure.auto=false", "--check"))
        self.assertEqual(self.line.status()["cameras"][0]["health"]["boot_id"], before)  # nothing was disturbed
        self.ask("config", "set", "cam1", "exposure.auto=false", "health.period_s=1.5")
        self.assertEqual(self.ask("config", "get", "cam1", "exposure.auto").strip(), "false")
        # They outlast a kill, and the node measures on.
        self.line.end("cam1", signal.SIGKILL)
        self.line.start_again("cam1")
        self.line.wait_alive("cam1")
        self.assertEqual(self.ask("config", "get", "cam1", "health.period_s").strip(), "1.5")
        self.line.trigger(0, 1, wait=False)
        self.line.wait_for(lambda status: status["cameras"][0]["last_imprint"], "an imprint")

    def test_settings_with_which_the_node_does_not_come_back_are_rolled_back(self):
        said = self.ask("config", "set", "cam1", 'zenoh.connect=["tcp/127.0.0.1:9"]', status=1)
        self.assertIn("rolled back: fusion was not found with them", said)
        self.line.wait_alive("cam1")
        self.assertIn(self.line.endpoint, self.ask("config", "get", "cam1", "zenoh.connect"))

    def test_health_reaches_status_and_prometheus(self):
        status = self.line.wait_for(lambda status: status["cameras"][0]["health"], "health")
        health = status["cameras"][0]["health"]
        self.assertTrue(25 <= health["housing_temperature_c"] <= 45, health)
        self.assertIsNone(health["sensor_temperature_c"])
        self.assertGreater(health["storage_free_mb"], 0)
        with urllib.request.urlopen(f"http://127.0.0.1:{self.line.page}/metrics", timeout=10) as answer:
            text = answer.read().decode()
        self.assertIn('imprint_camera_connected{site="plant",line="L1",camera="cam1"} 1', text)
        self.assertIn('imprint_camera_housing_temperature_celsius{site="plant",line="L1",camera="cam1"}', text)

    def test_the_page_triggers(self):
        body = json.dumps({"session": "from-page", "observations_expected": 1}).encode()
        request = urllib.request.Request(f"http://127.0.0.1:{self.line.page}/api/trigger", body, {"X-Imprint": "1"})
        with urllib.request.urlopen(request, timeout=10) as answer:
            self.assertEqual(json.load(answer)["session"], "from-page")
        status = self.line.wait_for(lambda status: status["cameras"][0]["last_imprint"], "an imprint")
        self.assertEqual(status["cameras"][0]["last_imprint"]["session"], "from-page")


if __name__ == "__main__":
    unittest.main(verbosity=2)
