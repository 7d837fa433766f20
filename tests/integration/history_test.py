"""Histories to PostgreSQL: a line that measures while the server is away, killed and put back, against a real one."""
import pathlib
import shutil
import signal
import sys
import tempfile
import time
import unittest
import urllib.request

import postgres_server
from ready_imprints import ReadyImprints, ReadyLine
from running_line import CAMERAS, PATIENCE_S

work = ready = None


def setUpModule():
    global work, ready
    work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-history-"))
    unittest.addModuleCleanup(shutil.rmtree, work, ignore_errors=True)
    ready = ReadyImprints(work)


class HistoryTest(unittest.TestCase):
    def measure(self, line, *sessions):
        for session in sessions:
            line.trigger_until_taken(session)
        line.wait_for_results(sessions)

    def test_what_was_measured_while_the_server_was_away_is_there_exactly_once(self):
        with postgres_server.PostgresServer() as server, ReadyLine(work, ready) as line:
            line.start_fusion("--set", f'history.postgresql="{server.address}"')  # before there is a server
            line.start_nodes(*CAMERAS)
            line.wait_alive(*CAMERAS)
            self.measure(line, "before")
            status = line.wait_for(lambda status: (status["history"] or {}).get("waiting_messages") == 4, "four messages wait")
            self.assertFalse(status["history"]["connected"])
            self.assertIn("history", [alarm["name"] for alarm in status["alarms"]])

            server.start()
            line.wait_for(lambda status: status["history"]["connected"], "fusion has found the server")
            self.wait_until_copied(line, server)
            self.measure(line, "with-0", "with-1")
            self.wait_until_copied(line, server)

            for session in ("killed-0", "killed-1"):
                line.trigger_until_taken(session)
            server.end_at_once()
            line.wait_for_results(["killed-0", "killed-1"])
            self.measure(line, "away-0")
            line.wait_for(lambda status: status["history"]["connected"] is False, "fusion sees that the server is away")
            line.end("fusion", signal.SIGKILL)
            line.start_again("fusion")
            line.wait_alive(*CAMERAS)
            self.measure(line, "away-1")
            server.start()
            self.measure(line, "after")
            self.wait_until_copied(line, server)

            sessions = ["after", "away-0", "away-1", "before", "killed-0", "killed-1", "with-0", "with-1"]
            self.assertEqual(server.rows("SELECT session FROM imprint.session WHERE complete AND length_mm > 0 ORDER BY session"),
                             [[session] for session in sessions])
            self.assertEqual(server.rows("SELECT DISTINCT site, line FROM imprint.session"), [["plant", "L1"]])
            self.assertEqual(self.copied_messages(server), self.stored_messages(line))
            self.assertEqual(server.rows("SELECT session, revision, result FROM imprint.result ORDER BY session"),
                             [list(map(str, row)) for row in line.stored("SELECT session, revision, json FROM result ORDER BY session")])
            with urllib.request.urlopen(f"http://127.0.0.1:{line.page}/metrics", timeout=10) as answer:
                metrics = answer.read().decode()
            self.assertIn('imprint_history_connected{site="plant",line="L1"} 1\n', metrics)
            self.assertIn('imprint_history_waiting_messages{site="plant",line="L1"} 0\n', metrics)

            # A copy of a later program is left alone, and said so.
            server.rows("UPDATE imprint.version SET number = 99")
            server.end_at_once()
            server.start()
            line.wait_for(lambda status: any("schema 99" in alarm["text"] for alarm in status["alarms"]), "the newer schema is refused")

    def stored_messages(self, line):
        rows = line.stored("SELECT id, session, observation, ifnull(camera, ''), hex(bytes) FROM message ORDER BY id")
        return [list(map(str, row)) for row in rows]

    def copied_messages(self, server):
        return server.rows("SELECT id, session, observation, coalesce(camera, ''), upper(encode(bytes, 'hex')) "
                           "FROM imprint.message ORDER BY id")

    def wait_until_copied(self, line, server):
        newest = [list(map(str, line.stored("SELECT (SELECT max(id) FROM message), (SELECT max(revision) FROM result)")[0]))]
        until = time.monotonic() + PATIENCE_S
        while (found := server.rows("SELECT (SELECT max(id) FROM imprint.message), (SELECT max(revision) FROM imprint.result)")) != newest:
            self.assertLess(time.monotonic(), until, f"{found} instead of {newest}\n{line.logs()}")
            time.sleep(0.2)
        line.wait_for(lambda status: status["history"] == {"connected": True, "waiting_messages": 0, "waiting_results": 0} and
                      "history" not in [alarm["name"] for alarm in status["alarms"]], "the status says so")


if __name__ == "__main__":
    if postgres_server.installed() is None:
        print("skipped: no PostgreSQL server is installed")
        sys.exit(77)
    unittest.main(verbosity=2)
