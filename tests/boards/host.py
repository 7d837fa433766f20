#!/usr/bin/env python3
"""The fusion host's Debian package in a fresh Debian: it is installed with what it depends on, upgraded from a former version
with a database of a former schema, removed and purged; the database is there all the while, and its sessions in the new program."""
import json
import os
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
import urllib.request

import guest
from guest import run
import plant

sys.path.insert(0, str(plant.ROOT / "deploy/deb"))
import make_deb

DATABASE = "var/lib/imprint/imprint.db"


def inside(root, *command, check=True):
    done = subprocess.run(["chroot", str(root), *map(str, command)], capture_output=True, text=True, check=False)
    if check and done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: {done.stdout[-500:]}{done.stderr[-500:]}")
    return done.stdout


def expect(condition, what):
    if not condition:
        raise RuntimeError(f"expected that {what}")


def version_of(root):
    with sqlite3.connect(f"file:{root / DATABASE}?mode=ro", uri=True) as database:
        return database.execute("PRAGMA user_version").fetchone()[0]


def sessions_of(root):
    """What the installed program says it holds, as the user it runs as."""
    port = plant.free_port()
    fusion = subprocess.Popen(["chroot", "--userspec=imprint:imprint", str(root), "imprint-fusion", "--config", "/etc/imprint/fusion.toml",
                               "--set", f"page.port={port}", "--set", f'zenoh.listen=["tcp/127.0.0.1:{plant.free_port()}"]'],
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        until = time.monotonic() + 60
        while True:
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/sessions", timeout=10) as answer:
                    return {session["session"]: session["length_mm"] for session in json.load(answer)["sessions"]}
            except OSError:
                if fusion.poll() is not None or time.monotonic() > until:
                    fusion.kill()
                    raise RuntimeError(f"the installed program gives no page: {fusion.communicate()[1][-500:]}") from None
                time.sleep(0.2)
    finally:
        fusion.terminate()
        fusion.wait(60)
        fusion.stderr.close()


def main(build):
    work = pathlib.Path(tempfile.mkdtemp(prefix="imprint-host-"))
    root = work / "root"
    try:
        former = make_deb.make_deb(pathlib.Path(build).resolve(), work, "0.0.1")
        new = make_deb.make_deb(pathlib.Path(build).resolve(), work, "0.0.2")
        mirror = os.environ.get("IMPRINT_DEBIAN_MIRROR")
        run("mmdebstrap", "--quiet", "--variant=minbase", "--aptopt=APT::Install-Recommends \"false\"", f"--include={former}", 
            f"--hook-dir=/usr/share/mmdebstrap/hooks/file-mirror-automount", "bookworm", root, *([mirror] if mirror else []))
        expect(inside(root, "getent", "passwd", "imprint").startswith("imprint:"), "the package makes the user imprint")
        expect((root / "etc/systemd/system/multi-user.target.wants/imprint-fusion.service").is_symlink(), "its unit is enabled")

        run(build + "/cli/imprint", "simulate", plant.SCENE, "--out", work / "rendered", stdout=subprocess.DEVNULL)
        shutil.copytree(work / "rendered", root / "etc/imprint", dirs_exist_ok=True)
        config = root / "etc/imprint/fusion.toml"
        config.write_text(config.read_text().replace('line = "L1"', 'line = "press-2"'))
        (root / DATABASE).parent.mkdir(exist_ok=True)
        with sqlite3.connect(root / DATABASE) as database:
            database.executescript((plant.ROOT / "tests/data/store/schema2.sql").read_text())
        inside(root, "chown", "-R", "imprint:imprint", "/var/lib/imprint")

        shutil.copy(new, root / "new.deb")
        inside(root, "dpkg", "--force-confold", "-i", "/new.deb")
        expect("0.0.2" in inside(root, "dpkg-query", "-W", "-f", "${Version}", "imprint-fusion"), "the new version is installed")
        expect('line = "press-2"' in config.read_text(), "the config somebody has changed stays")
        expect(version_of(root) == 2, "installing alone does not touch the database")
        sessions = sessions_of(root)
        expect(sessions.get("F-0001") == 2310.25 and "F-0002" in sessions, f"the former sessions are there, found {sessions}")
        newest = version_of(root)
        expect(newest > 2, "the new program has taken the database over")

        inside(root, "dpkg", "-r", "imprint-fusion")
        expect((root / DATABASE).exists() and config.exists(), "database and config stay when the package is removed")
        inside(root, "dpkg", "-P", "imprint-fusion")
        expect(version_of(root) == newest and not config.exists(), "the database stays even when it is purged")
        print(f"host: {new.stat().st_size / 1e6:.1f} MB with {len(inside(root, 'dpkg-query', '-W').splitlines())} packages installed, "
              f"schema 2 to {newest}, {len(sessions)} sessions kept")
        return 0
    finally:
        shutil.rmtree(work, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
