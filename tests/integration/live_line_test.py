"""The running line, fed with a small rendered session."""
import json
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import tomllib
import unittest
import urllib.error
import urllib.request

import running_line
from running_line import FUSION, IMPRINT, NODE, PATIENCE_S, SANITIZED_FACTOR, SCENE, free_port, imprint

SAME_MM = 0.01  # what the distributed run may differ from `imprint measure`: the rounding of curves on the wire

work = data = reference = rotations = None


def setUpModule():
    global work, data, reference, rotations
    work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-integration-"))
    unittest.addModuleCleanup(shutil.rmtree, work, ignore_errors=True)
    data = work / "session"
    subprocess.run([IMPRINT, "simulate", SCENE, "--out", data], check=True, stdout=subprocess.DEVNULL)
    measured = subprocess.run([IMPRINT, "measure", data / "session.toml", "--json"], check=True, capture_output=True)
    reference = json.loads(measured.stdout)
    with open(data / "session.toml", "rb") as file:
        rotations = [observation["rotation_deg"] for observation in tomllib.load(file)["observation"]]


class Line(running_line.Line):
    """A line that looks at the rendered session, or at other `images`."""

    def __init__(self, deadline_s=PATIENCE_S, images=None):
        super().__init__(work, data / "rig.toml", "folder", images or data, deadline_s)

    def trigger(self, observation, expect, wait=True, session="S"):
        return super().trigger(observation, expect, wait, session, rotations[observation])


class LiveLineTest(unittest.TestCase):
    def assert_same_geometry(self, result, expected):
        self.assertEqual(len(result["observations"]), len(expected["observations"]))
        for key in ("length_mm", "max_deflection_mm"):
            self.assertAlmostEqual(result[key], expected[key], delta=SAME_MM, msg=key)
        self.assertEqual(len(result["sections"]), len(expected["sections"]))
        for ours, theirs in zip(result["sections"], expected["sections"]):
            for key in ("s_mm", "deflection_mm", "diameter_mm", "circularity_mm"):
                self.assertAlmostEqual(ours[key], theirs[key], delta=SAME_MM, msg=key)
            for a, b in zip(ours["axis_mm"], theirs["axis_mm"]):
                self.assertAlmostEqual(a, b, delta=SAME_MM)

    def test_distributed_run_equals_measure(self):
        with Line() as line:
            line.start_fusion()
            line.start_nodes("cam1", "cam2", "cam3")
            line.wait_alive("cam1", "cam2", "cam3")
            results = line.watch("--results", "--count", len(rotations), "--timeout", 3 * PATIENCE_S)
            everything = line.watch()
            time.sleep(2)  # a watch says nothing when it begins to listen
            for observation in range(len(rotations)):
                result = line.trigger(observation, len(rotations))
            self.assert_same_geometry(result, reference)
            self.assertEqual(result["observations"][1]["rotation_deg"], rotations[1])
            self.assertTrue(line.result()["complete"])
            written = json.loads((line.folder / "results" / "S" / "result.json").read_text())
            self.assertEqual(written, result)
            events = json.loads(results.communicate(timeout=PATIENCE_S)[0])
            self.assertEqual(results.returncode, 0)
            self.assertEqual([event["complete"] for event in events], [False] * (len(rotations) - 1) + [True])
            self.assertEqual(events[-1]["result"], result)
            everything.send_signal(signal.SIGINT)
            events = json.loads(everything.communicate(timeout=PATIENCE_S)[0])
            self.assertEqual(everything.returncode, 0)
            self.assertEqual({event["camera"] for event in events if event["event"] == "imprint"}, {"cam1", "cam2", "cam3"})
            self.assertEqual({event["event"] for event in events}, {"camera", "trigger", "imprint", "result"})

            for path in ("/", "/api/status", "/api/cameras", "/api/sessions", "/api/result/latest", "/api/plots/S", "/healthz"):
                with urllib.request.urlopen(f"http://127.0.0.1:{line.page}{path}", timeout=10) as answer:
                    self.assertEqual(answer.status, 200, path)
            with self.assertRaises(urllib.error.HTTPError) as refused:
                line.result("another")
            self.assertEqual(refused.exception.code, 404)
            refused.exception.close()

            for name in ("cam1", "fusion", "cam2", "cam3"):
                status, took_s = line.end(name, signal.SIGTERM)
                self.assertEqual(status, 0, name)
                self.assertLess(took_s, 3 * SANITIZED_FACTOR, name)  # idle: nothing to finish

    def test_simulated_cameras_give_what_their_pictures_give(self):
        with Line() as line:
            line.start_fusion()
            line.start_nodes("cam1", "cam2", "cam3", capture__source='"simulation"', capture__path=f'"{SCENE}"',
                             exposure__auto="false")
            line.wait_alive("cam1", "cam2", "cam3")
            for observation in range(len(rotations)):
                result = line.trigger(observation, len(rotations))
            self.assert_same_geometry(result, reference)

    def test_systemd_hears_that_fusion_is_ready_and_turns(self):
        with Line() as line, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
            systemd.bind(str(line.folder / "notify"))
            systemd.settimeout(PATIENCE_S)
            line.start_fusion(NOTIFY_SOCKET=str(line.folder / "notify"), WATCHDOG_USEC="4000000")
            self.assertTrue(systemd.recv(4096).startswith(b"READY=1"))
            begin = time.monotonic()
            self.assertEqual([systemd.recv(4096) for _ in range(3)], [b"WATCHDOG=1"] * 3)
            self.assertGreater(time.monotonic() - begin, 5)  # every 2 s, half of what is allowed
            self.assertEqual(line.end("fusion", signal.SIGTERM)[0], 0)
            systemd.settimeout(0)
            heard = set()
            while True:
                try:
                    heard.add(systemd.recv(4096))
                except BlockingIOError:
                    break
            self.assertIn(b"STOPPING=1", heard)

    def test_camera_that_never_reports_is_left_out_and_named(self):
        with Line(deadline_s=5 * SANITIZED_FACTOR) as line:
            line.start_fusion()
            line.start_nodes("cam1", "cam2")
            line.wait_alive("cam1", "cam2")
            result = line.trigger(0, 1)
            cameras = {camera["id"]: camera["excluded"] for camera in result["observations"][0]["cameras"]}
            self.assertEqual(cameras, {"cam1": False, "cam2": False, "cam3": True})
            self.assertTrue(any("cam3" in warning and "not connected" in warning for warning in result["warnings"]),
                            result["warnings"])

    def test_nobody_reports_and_the_trigger_says_who(self):
        with Line(deadline_s=30 * SANITIZED_FACTOR) as line:
            line.start_fusion()
            done = imprint("trigger", "--connect", line.endpoint, "--session", "S", "--expect", 1, "--wait", 3)
            self.assertEqual(done.returncode, 1)
            self.assertIn("cam1, cam2, cam3", done.stderr)
            self.assertEqual(done.stdout, "")

    def test_fusion_started_last(self):
        with Line() as line:
            line.start_nodes("cam1", "cam2", "cam3")
            time.sleep(1)
            line.start_fusion()
            line.wait_alive("cam1", "cam2", "cam3")
            self.assertEqual(len(line.trigger(0, 1)["observations"]), 1)

    def test_node_killed_in_the_middle_is_triggered_again_when_it_is_back(self):
        with Line() as line:
            line.start_fusion()
            line.start_nodes("cam1", "cam2", "cam3")
            line.wait_alive("cam1", "cam2", "cam3")
            line.trigger(0, 2)
            line.end("cam2", signal.SIGKILL)
            line.wait_alive("cam1", "cam3")
            line.trigger(1, 2, wait=False)
            line.wait_for(lambda status: status["session"]["observations"][1]["waiting"] == ["cam2"], "only cam2 is waited for")
            line.start_nodes("cam2")
            line.wait_for(lambda status: status["last_result"]["complete"], "session complete")
            result = line.result()["result"]
            self.assertEqual([o["index"] for o in result["observations"]], [0, 1])
            for observation in result["observations"]:
                self.assertFalse(any(camera["excluded"] for camera in observation["cameras"]), result["warnings"])

    def test_fusion_killed_after_the_first_observation_loses_nothing(self):
        with Line() as line:
            line.start_fusion()
            line.start_nodes("cam1", "cam2", "cam3")
            line.wait_alive("cam1", "cam2", "cam3")
            line.trigger(0, len(rotations))
            line.end("fusion", signal.SIGKILL)
            time.sleep(1)
            line.start_fusion()
            line.wait_alive("cam1", "cam2", "cam3")
            for observation in range(1, len(rotations)):
                result = line.trigger(observation, len(rotations))
            self.assert_same_geometry(result, reference)
            self.assertTrue(line.result()["complete"])

    def test_fusion_killed_while_cameras_answer_gets_their_imprints_later(self):
        with Line() as line:
            line.start_fusion()
            line.start_nodes("cam1", "cam2", "cam3")
            line.wait_alive("cam1", "cam2", "cam3")
            line.trigger(0, 1, wait=False)
            line.end("fusion", signal.SIGKILL)
            line.start_fusion()
            line.wait_for(lambda status: status["last_result"] and status["last_result"]["complete"], "session complete")
            cameras = line.result()["result"]["observations"][0]["cameras"]
            self.assertEqual([camera["id"] for camera in cameras if not camera["excluded"]], ["cam1", "cam2", "cam3"])

    def test_damaged_picture_fails_its_camera_at_once_and_by_name(self):
        images = pathlib.Path(tempfile.mkdtemp(dir=work))
        for camera in ("cam1", "cam2", "cam3"):
            picture = (data / f"obs00_{camera}.png").read_bytes()
            (images / f"obs00_{camera}.png").write_bytes(picture[: len(picture) // 2] if camera == "cam3" else picture)
        with Line(images=images) as line:
            line.start_fusion()
            line.start_nodes("cam1", "cam2", "cam3")
            line.wait_alive("cam1", "cam2", "cam3")
            result = line.trigger(0, 1)
            self.assertTrue(any("cam3" in warning and "obs00_cam3.png" in warning for warning in result["warnings"]),
                            result["warnings"])
            health = line.wait_for(lambda status: status["cameras"][2]["health"]["failed_frames"] == 1, "health of cam3")
            self.assertEqual(health["cameras"][0]["health"]["failed_frames"], 0)

    def test_camera_that_sees_the_forging_come_to_rest_makes_all_fire(self):
        images = pathlib.Path(tempfile.mkdtemp(dir=work))
        for picture in data.glob("obs0[01]_cam[123].png"):
            if "cam1" not in picture.name:
                shutil.copy(picture, images)
        with Line(images=images) as line:
            line.start_fusion("--set", "rest.accept=true", "--set", "rest.observations=2",
                              "--set", "rest.quiet_s=1")  # the next forging comes sooner than by a press
            line.start_nodes("cam1", rest__trigger="true", rest__hold_s=0.5, rest__period_ms=100)
            line.start_nodes("cam2", "cam3")
            line.wait_alive("cam1", "cam2", "cam3")
            time.sleep(2 * SANITIZED_FACTOR)  # nothing in view of cam1: nothing to come to rest
            self.assertEqual(line.stored("SELECT count(*) FROM message"), [(0,)])
            for observation in (0, 1):
                name = f"obs{observation:02}_cam1.png"
                time.sleep(2 * SANITIZED_FACTOR)  # turned as it is, it counts anew once it was out of sight for hold_s
                shutil.copy(data / name, images / "coming.png")
                (images / "coming.png").rename(images / name)
                status = line.wait_for(lambda status: status["last_result"] and len(status["session"]["observations"]) == observation + 1
                                       and not status["session"]["observations"][observation]["waiting"], "observed by itself")
                self.assertTrue(status["session"]["session"].startswith("rest-"), status["session"])
            line.wait_for(lambda status: status["last_result"]["complete"], "both observations")
            result = line.result("latest")["result"]
            self.assertEqual([o["rotation_deg"] for o in result["observations"]], [0.0, 60.0])
            self.assertFalse(any(camera["excluded"] for o in result["observations"] for camera in o["cameras"]), result["warnings"])
            self.assertFalse(any(" apart" in warning for warning in result["warnings"]), result["warnings"])
            time.sleep(2 * SANITIZED_FACTOR)  # it rests on: once is enough
            self.assertEqual(line.stored("SELECT count(*) FROM message WHERE camera IS NULL"), [(2,)])

    def test_no_fusion_no_trigger(self):
        begin = time.monotonic()
        done = imprint("trigger", "--connect", f"tcp/127.0.0.1:{free_port()}", "--session", "S", "--wait", 60)
        self.assertEqual(done.returncode, 1)
        self.assertIn("is imprint-fusion running", done.stderr)
        self.assertLess(time.monotonic() - begin, 20 * SANITIZED_FACTOR)


class BadConfigTest(unittest.TestCase):
    def refused(self, program, config, *arguments):
        done = subprocess.run([program, "--config", str(config), *arguments], capture_output=True, text=True,
                              timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)  # one line for a person
        return done.stderr

    def test_good_configs_are_said_to_be_good(self):
        with Line() as line:
            for program, config in ((NODE, line.node_config), (FUSION, line.fusion_config)):
                checked = subprocess.run([program, "--config", str(config), "--check"], capture_output=True, text=True, check=False)
                self.assertEqual((checked.returncode, checked.stdout), (0, f"{config}: OK\n"), checked.stderr)
                printed = subprocess.run([program, "--config", str(config), "--print-config"], capture_output=True, text=True,
                                         check=True)
                tomllib.loads(printed.stdout)
            self.assertFalse((line.folder / "imprint.db").exists())  # a check leaves nothing behind

    def test_faults_name_file_line_and_key(self):
        with Line() as line:
            broken = line.write("broken.toml", "[node]\ncamera_id = \"cam1\"\nrig = \n")
            self.assertIn("broken.toml:3:", self.refused(NODE, broken))
            wrong = line.write("wrong.toml", line.fusion_config.read_text().replace("deadline_s = ", "deadline_s = -"))
            number = wrong.read_text().split("\n").index(next(l for l in wrong.read_text().split("\n") if "deadline_s" in l)) + 1
            self.assertIn(f"wrong.toml:{number}: fusion.deadline_s", self.refused(FUSION, wrong))
            self.assertIn("missing.toml", self.refused(FUSION, line.folder / "missing.toml"))
            self.assertIn("cam9", self.refused(NODE, line.node_config, "--set", "node.camera_id=cam9", "--check"))
            self.assertIn("nowhere", self.refused(NODE, line.node_config, "--set", "capture.path=nowhere"))
            self.assertIn("norig.toml", self.refused(FUSION, line.fusion_config, "--set", "fusion.rig=norig.toml"))
            self.assertIn("no/folder", self.refused(FUSION, line.fusion_config, "--set", "fusion.database=no/folder/a.db", "--check"))
            self.assertIn("page.port", self.refused(FUSION, line.fusion_config, "--set", "page.port=70000"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
