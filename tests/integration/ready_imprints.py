"""Ready imprints of a small rendered session, so that hundreds of observations cost the nodes no work."""
import pathlib
import subprocess
import time
import tomllib

import running_line
from running_line import CAMERAS, IMPRINT, PATIENCE_S, SCENE


class ReadyImprints:
    """A rig, and in `folder` the imprints of each of its cameras for the first observations."""

    def __init__(self, work, observations=1):
        data = pathlib.Path(work) / "rendered"
        subprocess.run([IMPRINT, "simulate", SCENE, "--observations", str(observations), "--out", data], check=True,
                       stdout=subprocess.DEVNULL)
        with open(data / "session.toml", "rb") as file:
            self.rotations = [observation["rotation_deg"] for observation in tomllib.load(file)["observation"]]
        self.rig = data / "rig.toml"
        self.folder = pathlib.Path(work) / "ready"
        self.folder.mkdir()
        with running_line.Line(work, self.rig, "folder", data) as line:
            line.start_fusion()
            line.start_nodes(*CAMERAS)
            line.wait_alive(*CAMERAS)
            for index, rotation in enumerate(self.rotations):
                line.trigger(index, len(self.rotations), rotation_deg=rotation)
            for camera, observation, content in line.stored("SELECT camera, observation, bytes FROM message WHERE camera IS NOT NULL"):
                (self.folder / f"obs{observation:02}_{camera}.imprint").write_bytes(content)


class ReadyLine(running_line.Line):
    """A line whose nodes answer every observation with a ready imprint. Sessions have one observation each."""

    def __init__(self, work, ready, **settings):
        super().__init__(work, ready.rig, "imprints", ready.folder, **settings)
        self.ready = ready

    def start_all(self):
        self.start_fusion()
        self.start_nodes(*CAMERAS)
        self.wait_alive(*CAMERAS)

    def trigger_until_taken(self, session, in_s=0):
        """Whatever is being killed meanwhile: as an operator would, until the command says it was taken."""
        until = time.monotonic() + PATIENCE_S
        while True:
            try:
                return self.trigger(0, 1, wait=False, session=session, rotation_deg=self.ready.rotations[0], in_s=in_s)
            except AssertionError:
                if time.monotonic() > until:
                    raise

    def complete_sessions(self):
        """Sessions whose result holds all cameras."""
        rows = self.stored("SELECT session, (SELECT count(*) FROM json_each(result.json, '$.observations[0].cameras') "
                           "WHERE json_extract(value, '$.excluded') = 0) FROM result WHERE complete AND error = ''")
        return {session for session, cameras in rows if cameras == len(CAMERAS)}

    def wait_for_results(self, sessions, patience_s=PATIENCE_S):
        until = time.monotonic() + patience_s
        while not set(sessions) <= (complete := self.complete_sessions()):
            if time.monotonic() > until:
                raise AssertionError(f"no whole result of {sorted(set(sessions) - complete)}\n{self.logs()}")
            time.sleep(0.2)

    def account(self):
        """What the database says of delivery; fails where it is damaged, out of order or has a result twice."""
        assert self.stored("PRAGMA integrity_check") == [("ok",)]
        twice = self.stored("SELECT session FROM result GROUP BY session HAVING count(*) > 1")
        assert not twice, twice
        imprints = self.stored("SELECT camera, session, boot_id, sequence FROM message WHERE camera IS NOT NULL ORDER BY id")
        assert len({(camera, boot, sequence) for camera, _, boot, sequence in imprints}) == len(imprints)
        results, revisions = self.stored("SELECT count(*), max(revision) FROM result")[0]
        behind, newest = 0, {}
        for camera, _, boot, sequence in imprints:
            behind += sequence < newest.get((camera, boot), 0)
            newest[camera, boot] = max(sequence, newest.get((camera, boot), 0))
        return {"results": results, "results made anew": revisions - results, "imprints stored": len(imprints),
                "answered twice": len(imprints) - len({row[:2] for row in imprints}), "out of order": behind}
