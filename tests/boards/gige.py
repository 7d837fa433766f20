#!/usr/bin/env python3
"""GigE Vision: three cameras, each in a network namespace of its own, show one observation of a rendered forging; three
nodes take it through Aravis, fusion measures. The result is that of `imprint measure` on the same pictures."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "tests/data/small_forge.toml"
SAME_MM = 0.01  # the rounding of curves on the wire
BRIDGE = "imprint-gige"
LOST_PER_MILLE = 2  # of the last camera's packets: of a frame's 130 one is missing in every fourth


def run(*command):
    subprocess.run([str(word) for word in command], check=True, capture_output=True)


class Network:
    """Cameras behind a bridge, each in a namespace: what a plant's camera network is to the nodes."""

    def __init__(self, names):
        self.names = names

    def __enter__(self):
        self.remove()
        run("ip", "link", "add", BRIDGE, "type", "bridge")
        run("ip", "link", "set", BRIDGE, "mtu", 9000, "up")
        run("ip", "addr", "add", "169.254.77.1/24", "dev", BRIDGE)
        for number, name in enumerate(self.names, 11):
            run("ip", "netns", "add", f"gige-{name}")
            run("ip", "link", "add", f"gige-{name}", "mtu", 9000, "type", "veth", "peer", "name", "eth0", "netns", f"gige-{name}")
            run("ip", "link", "set", f"gige-{name}", "master", BRIDGE, "up")
            inside = ("ip", "-n", f"gige-{name}")
            run(*inside, "link", "set", "eth0", "mtu", 9000, "up")
            run(*inside, "addr", "add", f"169.254.77.{number}/24", "dev", "eth0")
        return self

    def remove(self):
        for name in self.names:
            subprocess.run(["ip", "netns", "del", f"gige-{name}"], check=False, capture_output=True)
        subprocess.run(["ip", "link", "del", BRIDGE], check=False, capture_output=True)

    def __exit__(self, *_):
        self.remove()


def reference(data):
    """What `imprint measure` says of the first observation alone."""
    session = (data / "session.toml").read_text()
    first = session[: session.find("[[observation]]", session.find("[[observation]]") + 1)]
    (data / "first.toml").write_text(first)
    done = subprocess.run([os.environ["IMPRINT"], "measure", data / "first.toml", "--json"], check=True, capture_output=True)
    return json.loads(done.stdout)


def take_from_cameras(line, data, frames_per_s, socket_buffer_mb):
    """Nodes of the line take frames through Aravis, not from the folder."""
    line.node_config.write_text(
        line.node_config.read_text().replace('source = "folder"', 'source = "aravis"').replace(f'path = "{data}"\n', "")
        + f"[exposure]\nauto = false\n[camera]\nframes_per_s = {frames_per_s}\nsocket_buffer_mb = {socket_buffer_mb}\npacket_bytes = 8000\n")


def main(build):
    if os.geteuid() != 0:
        print("needs root, for network namespaces")
        return 1
    build = pathlib.Path(build).resolve()
    os.environ.update({"IMPRINT": str(build / "cli/imprint"), "IMPRINT_NODE": str(build / "node/imprint-node"),
                       "IMPRINT_FUSION": str(build / "fusion/imprint-fusion"), "IMPRINT_SCENE": str(SCENE)})
    sys.path.insert(0, str(ROOT / "tests/integration"))
    import running_line  # reads the programs' places when it is imported
    cameras = running_line.CAMERAS
    with tempfile.TemporaryDirectory(prefix="imprint-gige-") as work, Network(cameras):
        data = pathlib.Path(work) / "session"
        subprocess.run([os.environ["IMPRINT"], "simulate", SCENE, "--out", data], check=True, stdout=subprocess.DEVNULL)
        expected = reference(data)
        with running_line.Line(work, data / "rig.toml", "folder", data) as line:
            take_from_cameras(line, data, 10.0, 4.0)
            for camera in cameras:
                loss = LOST_PER_MILLE if camera == cameras[-1] else 0
                line.start(f"gige-{camera}", ["ip", "netns", "exec", f"gige-{camera}", build / "tests/boards/gige_camera", "eth0",
                                              camera, data / f"obs00_{camera}.png", loss])
            line.start_fusion()
            for camera in cameras:
                line.start_nodes(camera, camera__device=f"Aravis-Fake-{camera}")
            line.wait_alive(*cameras)
            done = line.trigger(0, 3)
            status = line.status()
            result = line.result()["result"]
            health = {camera["id"]: camera["health"] for camera in status["cameras"]}
            for camera in cameras:
                print(f"{camera}: dropped {health[camera]['dropped_frames']}, restarts {health[camera]['capture_restarts']}, "
                      f"targets {health[camera]['targets_seen']}, {health[camera]['capture_fault'] or 'frames come'}")
            differences = {key: result[key] - expected[key] for key in ("length_mm", "max_deflection_mm")}
            print(f"length {result['length_mm']:.3f} mm, deflection {result['max_deflection_mm']:.3f} mm, beside imprint measure "
                  + ", ".join(f"{key} {value:+.4f}" for key, value in differences.items()))
            faults = [key for key, value in differences.items() if abs(value) > SAME_MM]
            if len(result["observations"][0]["cameras"]) != 3 or not done:
                faults.append("three cameras")
            # Killed, a camera is lost; started again it is found again.
            line.end(f"gige-{cameras[0]}", running_line.signal.SIGKILL)
            line.wait_for(lambda s: s["cameras"][0]["health"]["capture_fault"] and
                          any(a["name"] == f"capture_{cameras[0]}" for a in s["alarms"]), "the camera's loss is an alarm")
            line.start_again(f"gige-{cameras[0]}")
            line.wait_for(lambda s: not s["cameras"][0]["health"]["capture_fault"], "the camera is found again")
            line.trigger(0, 3, session="S2")
            again = line.result("S2")["result"]
            print(f"after {cameras[0]} was lost and came back: length {again['length_mm']:.3f} mm")
            if abs(again["length_mm"] - expected["length_mm"]) > SAME_MM:
                faults.append("the same length after a loss")
            print("failed: " + ", ".join(faults) if faults else "as measured from the files")
            return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
