"""A recording of a running line, read by others, fused anew here and by another fusion: the same to the last bit."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import python_environment
from ready_imprints import ReadyImprints, ReadyLine
from running_line import IMPRINT, PATIENCE_S, imprint

HERE = pathlib.Path(__file__).resolve().parent
READER = """
import json, sys
from mcap.reader import make_reader
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
counts, sessions = {}, set()
with open(sys.argv[1], "rb") as file:
    for schema, channel, message in make_reader(file).iter_messages():
        counts[schema.name] = counts.get(schema.name, 0) + 1
        files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
        pool = descriptor_pool.DescriptorPool()
        for described in files.file:
            pool.Add(described)
        prototype = message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(schema.name))
        if schema.name == "imprint.v1.Imprint":
            sessions.add(prototype.FromString(message.data).session)
print(json.dumps({"counts": counts, "sessions": sorted(sessions)}))
"""


def figures(result):
    """What is measured, without what only one run knew."""
    return {key: value for key, value in result.items() if key not in ("made_at", "line", "warnings")}


class RecordingTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-recording-"))
        cls.addClassCleanup(shutil.rmtree, cls.work, ignore_errors=True)
        cls.ready = ReadyImprints(cls.work)
        cls.recording = cls.work / "line.mcap"
        with ReadyLine(cls.work, cls.ready) as line:
            line.start_all()
            with subprocess.Popen([IMPRINT, "record", "--connect", line.endpoint, "--out", cls.recording, "--json"],
                                  stdout=subprocess.PIPE, text=True) as recorder:
                time.sleep(2)  # it says nothing when it begins to listen
                for session in ("A", "B"):
                    line.trigger_until_taken(session)
                    line.wait_for_results([session])
                time.sleep(0.5)  # the announcement follows what is stored
                recorder.send_signal(signal.SIGINT)
                cls.recorded = json.loads(recorder.communicate(timeout=PATIENCE_S)[0])
            cls.results = {session: line.result(session)["result"] for session in ("A", "B")}

    def test_every_message_is_there(self):
        counts = self.recorded["messages"]
        self.assertEqual((counts["Trigger"], counts["Imprint"], counts["Result"]), (2, 6, 2))
        self.assertEqual(self.recorded["dropped"], 0)

    def test_an_independent_reader_understands_it(self):
        python = python_environment.ensure(os.environ["IMPRINT_PYTHON"], HERE / "requirements.txt")
        read = json.loads(subprocess.run([python, "-c", READER, self.recording], capture_output=True, check=True).stdout)
        self.assertEqual(read["counts"]["imprint.v1.Imprint"], 6)
        self.assertEqual(read["counts"]["imprint.v1.Trigger"], 2)
        self.assertEqual(read["sessions"], ["A", "B"])

    def test_fused_anew_it_gives_the_same_bit_for_bit(self):
        done = imprint("replay", self.recording, "--rig", self.ready.rig, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        sessions = json.loads(done.stdout)["sessions"]
        self.assertEqual([entry["same_as_recorded"] for entry in sessions], [True, True])
        for entry in sessions:
            self.assertEqual(figures(entry["result"]), figures(self.results[entry["session"]]))

    def test_another_fusion_fed_with_it_gives_the_same(self):
        with ReadyLine(self.work, self.ready) as line:
            line.start_fusion()
            line.wait_alive()
            done = imprint("replay", self.recording, "--connect", line.endpoint)
            self.assertEqual(done.returncode, 0, done.stderr)
            line.wait_for_results(["A", "B"])
            for session in ("A", "B"):
                self.assertEqual(figures(line.result(session)["result"]), figures(self.results[session]))

    def test_a_recording_that_differs_is_noticed(self):
        content = self.recording.read_bytes()
        place = content.index(b'"length_mm":') + len(b'"length_mm":')
        digit = b"1" if content[place:place + 1] != b"1" else b"2"
        changed = self.work / "changed.mcap"
        changed.write_bytes(content[:place] + digit + content[place + 1:])
        done = imprint("replay", changed, "--rig", self.ready.rig)
        self.assertEqual(done.returncode, 1)
        self.assertIn("DIFFERS", done.stdout)

    def test_wrong_use_is_one_line_and_status_2(self):
        for arguments in (["replay", self.recording], ["replay", self.ready.rig, "--rig", self.ready.rig],
                          ["replay", self.work / "none.mcap", "--rig", self.ready.rig]):
            done = imprint(*arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        self.assertEqual(imprint("replay", self.recording, "--rig", self.ready.rig, "--session", "C").returncode, 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
