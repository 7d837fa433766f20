"""The fault suite in its short form; the full counts are `./dev soak`'s."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import faults
import python_environment
from ready_imprints import ReadyImprints

HERE = pathlib.Path(__file__).resolve().parent
work = ready = python = None


def setUpModule():
    global work, ready, python
    work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-faults-"))
    unittest.addModuleCleanup(shutil.rmtree, work, ignore_errors=True)
    python = python_environment.ensure(os.environ["IMPRINT_PYTHON"], HERE / "requirements.txt")
    ready = ReadyImprints(work)


def refusal(*command):
    """Why this machine does not let a test do that; none when it does."""
    done = subprocess.run(command, capture_output=True, text=True, check=False) if shutil.which(command[0]) else None
    return f"{command[0]} is not installed" if done is None else done.stderr.strip()


no_namespaces = refusal("ip", "netns", "add", "imprint-probe")
if not no_namespaces:
    subprocess.run(["ip", "netns", "del", "imprint-probe"], check=True)
no_loss = no_namespaces or refusal("nft", "list", "tables")
no_shaping = no_namespaces or refusal("tc", "qdisc", "show")
no_mount = refusal("mount", "-t", "tmpfs", "-o", "size=4k", "tmpfs", "/mnt")
if not no_mount:
    subprocess.run(["umount", "/mnt"], check=True)


class FaultTest(unittest.TestCase):
    def test_programs_killed_at_random_moments_lose_nothing_and_do_nothing_twice(self):
        faults.kills(work, ready, python, observations=16, kill_count=8)

    @unittest.skipIf(no_namespaces, f"needs network namespaces: {no_namespaces}")
    def test_what_was_taken_while_the_cable_was_cut_arrives_in_order(self):
        faults.cable_cut(work, ready, cut_s=3, observations=3)

    @unittest.skipIf(no_loss, f"needs network namespaces and nft: {no_loss}")
    def test_nothing_is_lost_with_a_fifth_of_the_packets(self):
        faults.packet_loss(work, ready, percent=20, observations=3)

    @unittest.skipIf(no_shaping, f"needs network namespaces and tc: {no_shaping}")
    def test_imprints_and_peeks_pass_a_link_of_64_kbit(self):
        faults.thin_link(work, ready, minutes=1, live_s=10)

    @unittest.skipIf(no_mount, f"needs a small disk: {no_mount}")
    def test_a_node_with_a_full_disk_goes_on_measuring_with_an_alarm(self):
        faults.node_disk_full(work, ready)

    @unittest.skipIf(no_mount, f"needs a small disk: {no_mount}")
    def test_fusion_with_a_full_disk_stops_with_an_alarm_and_goes_on_when_there_is_room(self):
        faults.fusion_disk_full(work, ready)

    def test_clocks_that_jump_by_an_hour_harm_no_grouping(self):
        faults.clock_jumps(work, ready)

    def test_a_hostile_client_takes_bounded_memory_and_changes_nothing(self):
        figures = faults.hostile_client(work, ready, python, messages=5000)
        self.assertLess(figures["fusion_grew_mb"], 150)


if __name__ == "__main__":
    unittest.main(verbosity=2)
