"""Who is let in on mutual TLS, and what a certificate allows: real programs, each wrong certificate there is."""
import json
import os
import pathlib
import shutil
import signal
import ssl
import subprocess
import tempfile
import time
import unittest
import urllib.error
import urllib.request

import python_environment
from ready_imprints import ReadyImprints
from running_line import CAMERAS, PATIENCE_S, imprint
from secure_line import Plant, SecureLine

HERE = pathlib.Path(__file__).resolve().parent
work = ready = python = None


def setUpModule():
    global work, ready, python
    work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-security-"))
    unittest.addModuleCleanup(shutil.rmtree, work, ignore_errors=True)
    python = python_environment.ensure(os.environ["IMPRINT_PYTHON"], HERE / "requirements.txt")
    ready = ReadyImprints(work)


class SecurityTest(unittest.TestCase):
    def measures(self, line, session, cameras=CAMERAS):
        line.trigger_until_taken(session)
        if cameras == CAMERAS:
            line.wait_for_results([session])
        else:
            line.wait_for(lambda status: status["session"]["session"] == session and
                          status["session"]["observations"][0]["reported"] == list(cameras), f"{cameras} have reported")

    def wait_for_log(self, line, text, name="fusion"):
        until = time.monotonic() + PATIENCE_S
        while text not in line.log(name):
            self.assertLess(time.monotonic(), until, f"not logged: {text}\n{line.logs()}")
            time.sleep(0.2)

    def test_wrong_certificates_are_refused_by_name_and_disturb_nothing(self):
        with SecureLine(work, ready, deadline_s=PATIENCE_S) as line:
            line.start_all()
            self.measures(line, "first")
            line.end("cam2", signal.SIGTERM)
            line.wait_alive("cam1", "cam3")

            with self.subTest("of another plant"):
                foreign = Plant(line.folder / "foreign", "another").issue("cam2")
                shutil.copy(line.plant.identity("cam2") / "ca.pem", foreign / "ca.pem")  # it trusts this plant's fusion
                line.start_camera("cam2", foreign)
                self.wait_for_log(line, "refused: a connection: invalid peer certificate: UnknownIssuer")
                self.wait_for_log(line, f"not let in at {line.endpoint}: received fatal alert: UnknownCA; own certificate cam2.", "cam2")
                line.wait_alive("cam1", "cam3")
                line.end("cam2", signal.SIGKILL)

            with self.subTest("none"):
                host = line.endpoint.split("/")[1]
                client = subprocess.run([python, HERE / "stranger.py", host, line.plant.identity("cam2") / "ca.pem"],
                                        capture_output=True, text=True, timeout=PATIENCE_S, check=False)
                self.assertIn("refused", client.stdout, client.stderr)
                self.wait_for_log(line, "refused: a connection: peer sent no certificates")

            with self.subTest("of the wrong camera"):
                before = line.status()
                line.start_camera("cam2", line.plant.identity("cam1"))
                name = line.plant.certs("list", "--json").split('"common_name": "cam1.')[1][:8]
                self.wait_for_log(line, f"refused: cam1.{name}: Put on imprint/plant/L1/v1/cam/cam2/health")
                status = line.wait_alive("cam1", "cam3")
                self.assertEqual(status["cameras"][1]["health"]["boot_id"], before["cameras"][1]["health"]["boot_id"])
                line.end("cam2", signal.SIGKILL)
            self.measures(line, "second", ("cam1", "cam3"))

            with self.subTest("revoked"):
                line.plant.certs("revoke", "cam3")
                self.wait_for_log(line, "certificate revoked")
                status = line.wait_alive("cam1")
                self.assertGreater(status["counters"]["denied"], 0)
                line.plant.issue("cam3")
                line.end("cam3", signal.SIGTERM)
                line.start_camera("cam3")
                line.start_camera("cam2")
                line.wait_alive(*CAMERAS)
            self.measures(line, "third")
            # What the two took while they were kept out is not lost either.
            line.wait_for_results(["first", "second", "third"])
            self.assertEqual(line.account()["results"], 3)

    def test_a_viewer_sees_and_an_operator_triggers(self):
        with SecureLine(work, ready, deadline_s=PATIENCE_S) as line:
            line.start_all()
            line.speak_as("viewer")
            self.assertIsNotNone(line.status())
            done = imprint("trigger", "--connect", line.endpoint, "--session", "by-viewer", "--expect", 1)
            self.assertEqual(done.returncode, 1, done.stdout)
            self.wait_for_log(line, ": Put on imprint/plant/L1/v1/trigger")
            line.speak_as("operator")
            self.measures(line, "by-operator")
            self.assertEqual(line.stored("SELECT DISTINCT session FROM message"), [("by-operator",)])

    def test_beyond_this_machine_the_page_is_https_and_for_users(self):
        with SecureLine(work, ready) as line:
            users = line.folder / "users.json"
            done = subprocess.run([os.environ["IMPRINT"], "users", "set", "otto", "--role", "operator", "--file", users],
                                  input="red steel 1200\n", capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertNotIn("red steel", users.read_text())
            line.start_all("--set", "page.address=0.0.0.0", "--set", f'page.users="{users}"')
            trusted = ssl.create_default_context(cafile=line.plant.folder / "ca.pem")
            page = f"https://127.0.0.1:{line.page}"

            def ask(path, body=None, cookie=""):
                request = urllib.request.Request(page + path, body and json.dumps(body).encode(), {"X-Imprint": "1", "Cookie": cookie})
                try:
                    with urllib.request.urlopen(request, timeout=10, context=trusted) as answer:
                        return answer.status, answer.headers.get("Set-Cookie", "")
                except urllib.error.HTTPError as refused:
                    with refused:
                        return refused.code, ""

            self.assertEqual(ask("/api/status")[0], 401)
            self.assertEqual(ask("/api/sign-in", {"name": "otto", "password": "red steel 1201"})[0], 401)
            status, cookie = ask("/api/sign-in", {"name": "otto", "password": "red steel 1200"})
            self.assertEqual(status, 200)
            self.assertIn("Secure", cookie)
            cookie = cookie.split(";")[0]
            self.assertEqual(ask("/api/status", cookie=cookie)[0], 200)
            self.assertEqual(ask("/api/trigger", {"session": "by-otto", "observations_expected": 1}, cookie)[0], 200)
            line.wait_for_results(["by-otto"])
            told = [json.loads(text) for text in (line.folder / "imprint.db.audit.jsonl").read_text().splitlines()]
            self.assertEqual([(entry["who"], entry["what"]) for entry in told],
                             [("somebody", "sign-in refused"), ("otto", "signed in"), ("otto", "triggered session by-otto observation 0")])

    def test_plain_endpoints_beyond_this_machine_are_refused(self):
        with SecureLine(work, ready) as line:
            for program, config in (("IMPRINT_NODE", line.node_config), ("IMPRINT_FUSION", line.fusion_config)):
                for setting, status in (('zenoh.listen=["tcp/0.0.0.0:7447"]', 2), ('zenoh.listen=["tcp/127.0.0.1:7447"]', 0)):
                    done = subprocess.run([os.environ[program], "--config", config, "--check", "--set", setting],
                                          capture_output=True, text=True, check=False)
                    self.assertEqual(done.returncode, status, done.stderr)
                    self.assertEqual("tls/HOST:PORT" in done.stderr, status == 2, done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
