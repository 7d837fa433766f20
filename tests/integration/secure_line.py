"""A line on mutual TLS: its own authority, a certificate for every program and person."""
import os

from ready_imprints import ReadyLine
from running_line import CAMERAS, imprint


class Plant:
    """A plant's authority in a folder, made by `imprint certs`."""

    def __init__(self, folder, name="forge"):
        self.folder = folder
        self.certs("init", "--plant", name)

    def certs(self, *arguments):
        done = imprint("certs", *arguments, "--dir", self.folder)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def issue(self, name, role="camera", *arguments):
        self.certs("issue", name, "--role", role, *arguments)
        return self.identity(name)

    def identity(self, name):
        return self.folder / "issued" / name


class SecureLine(ReadyLine):
    """Fusion listens on TLS alone; a command speaks with the certificate of `self.person`."""

    def __init__(self, work, ready, **settings):
        super().__init__(work, ready, **settings)
        self.endpoint = self.endpoint.replace("tcp/", "tls/")
        self.plant = Plant(self.folder / "certs")
        self.plant.issue("fusion", "fusion", "--host", "127.0.0.1")
        for camera in CAMERAS:
            self.plant.issue(camera)
        for person in ("viewer", "operator", "engineer"):
            self.plant.issue(person, person)

    def __enter__(self):
        self.speak_as("engineer")
        return super().__enter__()

    def __exit__(self, *arguments):
        os.environ.pop("IMPRINT_IDENTITY", None)
        super().__exit__(*arguments)

    def speak_as(self, person):
        os.environ["IMPRINT_IDENTITY"] = str(self.plant.identity(person))

    def start_all(self, *fusion_arguments):
        self.start_fusion(*fusion_arguments, "--set", f'zenoh.listen=["{self.endpoint}"]', "--set", f'zenoh.identity="{self.plant.identity("fusion")}"',
                          "--set", f'zenoh.access="{self.plant.folder / "access.json"}"')
        for camera in CAMERAS:
            self.start_camera(camera)
        self.wait_alive(*CAMERAS)

    def start_camera(self, camera, identity=None):
        self.start_nodes(camera, zenoh__connect=f'["{self.endpoint}"]',
                         zenoh__identity=f'"{identity or self.plant.identity(camera)}"')

    def log(self, name="fusion"):
        return (self.folder / f"{name}.log").read_text(errors="replace")
