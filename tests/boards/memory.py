#!/usr/bin/env python3
"""Memory of a node at 4656 x 3520: a GigE camera shows a rendered frame, the node measures it again and again."""
import os
import pathlib
import subprocess
import sys
import tempfile

import gige

SCENE = gige.ROOT / "simulation/scenes/forge.toml"
LIMIT_MB = 200
FRAMES = 5
SOCKET_MB = 64  # a frame comes at the speed of loopback
RECEIVE_MAX = pathlib.Path("/proc/sys/net/core/rmem_max")  # a board sets it too (firmware_config)


def peak_mb(process):
    fields = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines())
    return int(fields["VmHWM"].split()[0]) / 1024


def measure(running_line, build):
    with tempfile.TemporaryDirectory(prefix="imprint-memory-") as work, gige.Network(["cam1"]):
        data = pathlib.Path(work) / "session"
        subprocess.run([os.environ["IMPRINT"], "simulate", SCENE, "--observations", "1", "--out", data], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with running_line.Line(work, data / "rig.toml", "folder", data) as line:
            gige.take_from_cameras(line, data, 2.0, SOCKET_MB)
            line.start("gige", ["ip", "netns", "exec", "gige-cam1", build / "tests/boards/gige_camera", "eth0", "cam1",
                                data / "obs00_cam1.png"])
            line.start_fusion()
            line.start_nodes("cam1", camera__device="Aravis-Fake-cam1")
            line.wait_for(lambda s: s["cameras"][0]["alive"] and not s["cameras"][0]["health"]["capture_fault"], "frames come")
            for number in range(FRAMES):
                line.trigger(0, 1, wait=False, session=f"S{number}")
                line.wait_for(lambda s: s["cameras"][0]["health"]["frames"] > number, "a frame")
            health = line.status()["cameras"][0]["health"]
            taken_mb = peak_mb(line.processes["cam1"])
            print(f"node: {taken_mb:.0f} MB at most after {FRAMES} frames of 4656 x 3520, {health['targets_seen']} targets seen, "
                  f"allowed {LIMIT_MB} MB")
            return 0 if taken_mb < LIMIT_MB and health["targets_seen"] >= 10 else 1


def main(build):
    if os.geteuid() != 0:
        print("needs root, for a network namespace")
        return 1
    build = pathlib.Path(build).resolve()
    os.environ.update({"IMPRINT": str(build / "cli/imprint"), "IMPRINT_NODE": str(build / "node/imprint-node"),
                       "IMPRINT_FUSION": str(build / "fusion/imprint-fusion"), "IMPRINT_SCENE": str(SCENE)})
    sys.path.insert(0, str(gige.ROOT / "tests/integration"))
    import running_line  # reads the programs' places when it is imported
    allowed_before = RECEIVE_MAX.read_text()
    RECEIVE_MAX.write_text(str(2 * SOCKET_MB << 20))
    try:
        return measure(running_line, build)
    finally:
        RECEIVE_MAX.write_text(allowed_before)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
