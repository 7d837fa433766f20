"""The Debian package of a fusion host, unpacked beside this machine's files: its dependencies, its unit, its program at work."""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

from running_line import IMPRINT, PATIENCE_S, SCENE, free_port

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy/deb"))
import make_deb

work = deb = root = None


def output(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True).stdout


def setUpModule():
    global work, deb, root
    work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-deb-"))
    unittest.addModuleCleanup(shutil.rmtree, work, ignore_errors=True)
    os.environ.setdefault("SOURCE_DATE_EPOCH", "1700000000")  # also where the source is no git folder
    deb = make_deb.make_deb(pathlib.Path(os.environ["IMPRINT_BUILD"]), work, "0.0.1+test")
    root = work / "root"
    output("dpkg-deb", "-x", deb, root)


def owner(library):
    """The package a library on this machine comes from; dpkg knows the place before or after /usr was merged."""
    for place in (library, os.path.realpath(library), library.removeprefix("/usr"), os.path.realpath(library).removeprefix("/usr")):
        found = subprocess.run(["dpkg", "-S", place], capture_output=True, text=True, check=False)
        if found.returncode == 0:
            return found.stdout.split(":")[0]
    raise AssertionError(f"{library} is in no package")


def provided_by(package):
    """The package's own name and the virtual ones it stands for."""
    provides = output("dpkg-query", "-W", "-f", "${Provides}", package)
    return {package} | {entry.split()[0] for entry in provides.split(", ") if entry}


class DebTest(unittest.TestCase):
    def test_it_depends_on_the_packages_of_the_libraries_its_programs_load(self):
        depends = {entry.split()[0] for entry in output("dpkg-deb", "-f", deb, "Depends").split(", ")}
        loaded = set()
        for program in ("imprint-fusion", "imprint"):
            path = root / "usr/bin" / program
            places = dict(re.findall(r"(\S+) => (/\S+)", output("ldd", path)))
            needed = re.findall(r"NEEDED\s+(\S+)", output("objdump", "-p", path))
            self.assertGreater(len(needed), 10)
            loaded |= {owner(places[name]) for name in needed if name in places}
        unnamed = [package for package in loaded if not provided_by(package) & depends]
        self.assertEqual(unnamed, [])
        self.assertEqual(depends - {"systemd"} - set().union(*map(provided_by, loaded)), set())

    def test_its_unit_is_whole_and_hardened(self):
        unit = root / "usr/lib/systemd/system/imprint-fusion.service"
        placed = work / "imprint-fusion.service"  # as it stands, but for the program's place
        placed.write_text(unit.read_text().replace("ExecStart=/usr/bin/", f"ExecStart={root}/usr/bin/"))
        done = subprocess.run(["systemd-analyze", "verify", "--man=no", placed], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        done = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=20", unit], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout[-200:] + done.stderr)

    def test_its_program_starts_with_its_config_and_gives_its_page(self):
        self.assertIn("/etc/imprint/fusion.toml", output("dpkg-deb", "-I", deb, "conffiles").split())
        output(IMPRINT, "simulate", SCENE, "--out", work / "rendered")
        port = free_port()
        settings = {"fusion.rig": f'"{work}/rendered/rig.toml"', "fusion.database": f'"{work}/imprint.db"',
                    "zenoh.listen": f'["tcp/127.0.0.1:{free_port()}"]', "page.port": port}
        command = [root / "usr/bin/imprint-fusion", "--config", root / "etc/imprint/fusion.toml"]
        for key, value in settings.items():
            command += ["--set", f"{key}={value}"]
        with open(work / "fusion.log", "wb") as log:
            fusion = subprocess.Popen([str(word) for word in command], stdout=log, stderr=log)
        try:
            until = time.monotonic() + PATIENCE_S
            while True:
                try:
                    with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=10) as answer:
                        self.assertIn(b"Imprint", answer.read())
                    break
                except OSError:
                    self.assertLess(time.monotonic(), until, (work / "fusion.log").read_text())
                    self.assertIsNone(fusion.poll(), (work / "fusion.log").read_text())
                    time.sleep(0.2)
            fusion.send_signal(signal.SIGTERM)
            self.assertEqual(fusion.wait(PATIENCE_S), 0)
        finally:
            fusion.kill()
            fusion.wait()

    def test_the_same_programs_give_the_same_package(self):
        again = make_deb.make_deb(pathlib.Path(os.environ["IMPRINT_BUILD"]), work / "again", "0.0.1+test")
        self.assertEqual(again.read_bytes(), deb.read_bytes())


if __name__ == "__main__":
    unittest.main(verbosity=2)
