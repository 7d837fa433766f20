"""A PostgreSQL server of its own for one test, on a socket in a temporary folder, as a user who is not root."""
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time


def installed():
    """The folder of the server's programs, the newest installed; none where there is none."""
    found = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    on_path = shutil.which("initdb")
    return found[-1].parent if found else pathlib.Path(on_path).parent if on_path else None


class PostgresServer:
    def __init__(self):
        self.programs = installed()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="imprint-pg-"))  # short: a socket's path has 107 characters
        self.user = "postgres" if os.geteuid() == 0 else None
        if self.user:
            shutil.chown(self.folder, self.user)
        self.folder.chmod(0o755)
        self.process = None
        self.run("initdb", "--auth=trust", "--username=imprint", "--no-sync", "--encoding=UTF8", "--pgdata", self.folder / "data")

    def run(self, program, *arguments):
        subprocess.run([self.programs / program, *map(str, arguments)], user=self.user, check=True, cwd=self.folder,
                       stdout=subprocess.DEVNULL, env={"LC_ALL": "C", "PATH": os.environ["PATH"]})

    @property
    def address(self):
        return f"postgresql://imprint@/postgres?host={self.folder}"

    def start(self):
        with open(self.folder / "server.log", "ab") as log:
            self.process = subprocess.Popen(
                [self.programs / "postgres", "-D", self.folder / "data", "-k", self.folder, "-c", "listen_addresses=",
                 "-c", "fsync=off"], user=self.user, cwd=self.folder, stdout=log, stderr=log, env={"LC_ALL": "C"})
        until = time.monotonic() + 60
        while True:
            try:
                return self.rows("SELECT 1")
            except subprocess.CalledProcessError:
                if time.monotonic() > until or self.process.poll() is not None:
                    raise AssertionError((self.folder / "server.log").read_text()) from None
                time.sleep(0.1)

    def end_at_once(self):
        """Without a word to who is connected; it recovers when it starts again."""
        self.process.send_signal(signal.SIGQUIT)
        self.process.wait(60)

    def rows(self, query):
        """Its rows as lists of texts."""
        done = subprocess.run([self.programs / "psql", "-XAtq", "-F", "\t", "-v", "ON_ERROR_STOP=1", "-d", self.address, "-c", query],
                              capture_output=True, text=True, check=True, timeout=60)
        return [line.split("\t") for line in done.stdout.splitlines()]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process and self.process.poll() is None:
            self.end_at_once()
        shutil.rmtree(self.folder, ignore_errors=True)
