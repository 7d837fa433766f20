#!/usr/bin/env python3
"""./dev bench [NAME]: what the node costs and how near the truth the measurement comes.

stages    renders one frame of the forge scene; prints the time of every stage beside cv::Canny, and of the renderer.
latency   trigger to stored result over Zenoh on loopback, the nodes' work already done: median and 99th percentile.
accuracy  renders and measures several seeds of both scenes; prints the errors against the truth.
targets   the paper's target benchmark, recall and precision beside OpenCV's ArUco; only when asked for.
centers   the spread of rendered targets' centres beside the bound, their bias, the stated sigma; only when asked for.
calibration  tables 3 to 5 and figure 9 of paper B on rendered frames, and 200 repetitions; only when asked for.
survey    60 rendered photographs of a target field, surveyed and held against the truth; only when asked for.
edges     single points of clean straight rims beside the bound, all methods; status 1 when it is missed; only when asked for.
segmentation  300 frames with a forging and 200 empty halls: found, said to have failed, wrong; only when asked for.
          Takes --frames N --halls N --first I --numbers I,K,... --seed S --only KIND --save DIR --keep DIR.
silhouettes  tables 2 to 7 of paper C on rendered scenes, all seven methods; only when asked for.
          Takes --only NAME --seed S --of N --keep DIR.
multiview tables 1 to 4 and figure 17 of paper D on exactly known forgings, then on rendered ones; only when asked for.
clutter   200 frames of 4 megapixels without targets: what is claimed to be one; only when asked for.
"""
import argparse
import json
import pathlib
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BUILD = ROOT / "build"
IMPRINT = BUILD / "bin" / "imprint"
SCENES = ROOT / "simulation" / "scenes"


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: exit status {done.returncode}\n{done.stderr}")
    return done.stdout


def simulate(scene, folder, seed, observations, jobs):
    run(IMPRINT, "simulate", SCENES / f"{scene}.toml", "--seed", seed, "--observations", observations, "--jobs", jobs, "--out", folder)


def bench_stages(folder, _):
    begin = time.monotonic()
    simulate("forge", folder, 1, 1, 1)
    user = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    frames = 3
    print(run(BUILD / "tests" / "bench" / "node_bench", folder / "rig.toml", "cam1", folder / "obs00_cam1.png"), end="")
    print(f"renderer: {user / frames:.2f} s of one core a frame ({(time.monotonic() - begin) / frames:.2f} s by the clock), PNG included")


def bench_latency(folder, options):
    folder.mkdir(parents=True, exist_ok=True)
    integration = ROOT / "tests" / "integration"
    command = [sys.executable, integration / "latency.py", folder, "--observations", options.observations]
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, text=True, check=False)
    print(done.stdout, end="")
    if done.returncode:
        sys.exit(done.returncode)


def bench_accuracy(folder, options):
    rows = []
    for scene, observations in (("forge", 1), ("forge", 3), ("laboratory", 1)):
        for seed in range(options.first_seed, options.first_seed + options.seeds):
            shutil.rmtree(folder, ignore_errors=True)
            simulate(scene, folder, seed, observations, 2)
            run(IMPRINT, "measure", folder / "session.toml", "--out", folder / "result.json")
            report = json.loads(run(IMPRINT, "report", folder / "result.json", "--truth", folder / "truth.json", "--json"))
            rows.append((scene, observations, seed, report))
            print_row(scene, observations, str(seed), {**report["against_truth"], "length_error_mm": report["length_error_mm"]})
        mine = [row[3] for row in rows if row[:2] == (scene, observations)]
        worst = {key: max(abs(row["against_truth"][key]) for row in mine) for key in mine[0]["against_truth"]}
        for key in ("axis_covered", "diameter_covered", "circularity_covered"):
            worst[key] = statistics.mean(row["against_truth"][key] for row in mine)
        worst["length_error_mm"] = max((row["length_error_mm"] for row in mine), key=abs)
        print_row(scene, observations, "worst", worst)


def print_row(scene, observations, seed, values):
    print(f"{scene:<10} {observations} obs  seed {seed:>5}: axis RMS {values['axis_rms_mm']:.3f} mm, "
          f"diameter RMS {values['diameter_rms_mm']:.3f} mm (best 90 %: {values['diameter_rms_best90_mm']:.3f}), "
          f"length {values['length_error_mm']:+.3f} mm, circularity RMS {values['circularity_rms_mm']:.3f} mm, "
          f"95 % intervals hold {100 * values['axis_covered']:.0f} / {100 * values['diameter_covered']:.0f} / "
          f"{100 * values['circularity_covered']:.0f} %", flush=True)


def part_of(session, observations, cameras):
    """A session file of the first observations of another one, by some of its cameras."""
    rig, *entries = session.read_text(encoding="utf-8").split("[[observation]]")
    lines = [line for line in "[[observation]]".join([rig, *entries[:observations]]).splitlines()
             if not line.startswith("cam") or line.split("=")[0].strip() in cameras]
    part = session.with_name(f"first{observations}of{len(cameras)}.toml")
    part.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return part


def forge_with(scene, **keys):
    """Writes the forge scene with other values of some of its keys."""
    text = (SCENES / "forge.toml").read_text(encoding="utf-8")
    for key, value in keys.items():
        text, found = re.subn(rf"^{key} = .*", f"{key} = {value}", text, flags=re.MULTILINE)
        if found != 1:
            sys.exit(f"forge.toml: {key} stands there {found} times, once expected")
    scene.write_text(text, encoding="utf-8")


def bench_rendered_multiview(folder, options):
    cameras = ("cam1", "cam2", "cam3")
    scene = folder.parent / "forge12.toml"
    forge_with(scene, rotations_deg=[30.0 * k for k in range(12)])
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        shutil.rmtree(folder, ignore_errors=True)
        run(IMPRINT, "simulate", scene, "--seed", seed, "--jobs", 2, "--out", folder)
        for observations, seen_by in ((1, cameras[:2]), (1, cameras), (3, cameras), (6, cameras), (11, cameras)):
            session = part_of(folder / "session.toml", observations, seen_by)
            for geometry, method in (("joint", "best"), ("thesis", "orientation")):
                run(IMPRINT, "measure", session, "--geometry", geometry, "--method", method, "--out", folder / "result.json")
                report = json.loads(run(IMPRINT, "report", folder / "result.json", "--truth", folder / "truth.json", "--json"))
                values = {**report["against_truth"], "length_error_mm": report["length_error_mm"]}
                print_row(f"{geometry}, {len(seen_by)} cam.", observations, str(seed), values)


def print_widths(name, observations, seed, result, truth):
    """Widths across faces beside the truth's, in the order of their size."""
    errors, held = [], []
    for section in result["sections"]:
        nearest = min(truth["sections"], key=lambda true, at=section["s_mm"]: abs(true["s_mm"] - at))
        measured = sorted(section["facets"]["widths_mm"], key=lambda width: width["value"])
        for width, true in zip(measured, sorted(nearest["widths_mm"]), strict=True):
            errors.append(width["value"] - true)
            held.append(abs(errors[-1]) <= width["ci95"])
    print(f"{name:<10} {observations} obs  seed {seed:>5}: taken for {result['section']}, widths RMS "
          f"{statistics.fmean(error * error for error in errors) ** 0.5:.3f} mm (goal 0.3), mean {statistics.fmean(errors):+.3f} mm, "
          f"worst {max(map(abs, errors)):.3f} mm, 95 % intervals hold {100 * statistics.fmean(held):.0f} %", flush=True)


def bench_rendered_bars(folder, options):
    """Bars of 300 mm across faces, six observations at 30 degrees, their kind not told."""
    scene = folder.parent / "bar.toml"
    for name, faces in (("square", 4), ("octagon", 8)):
        forge_with(scene, rotations_deg=[30.0 * k for k in range(6)], stations=f"[[0.0, 300.0]]\nfaces = {faces}",
                   circularity_mm=0.0, press_marks=0, diameter_mm=[150.0, 450.0])
        for seed in range(options.first_seed, options.first_seed + options.seeds):
            shutil.rmtree(folder, ignore_errors=True)
            run(IMPRINT, "simulate", scene, "--seed", seed, "--jobs", 2, "--out", folder)
            run(IMPRINT, "measure", folder / "session.toml", "--out", folder / "result.json")
            result, truth = (json.loads((folder / file).read_text(encoding="utf-8")) for file in ("result.json", "truth.json"))
            if result["section"] != name:
                print(f"{name:<10} 6 obs  seed {seed:>5}: taken for {result['section']}")
                continue
            print_widths(name, 6, seed, result, truth)


def main():
    parser = argparse.ArgumentParser(prog="./dev bench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    papers = {"targets": "targets", "clutter": "targets", "centers": "targets", "calibration": "calibration", "survey": "survey",
              "edges": "silhouettes", "segmentation": "silhouettes", "silhouettes": None, "multiview": "multiview"}
    parser.add_argument("name", nargs="?", choices=["stages", "latency", "accuracy", *papers], help="default: the first three")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=101)
    parser.add_argument("--observations", type=int, default=100, help="of latency")
    options, rest = parser.parse_known_args()
    if rest and options.name not in papers:
        parser.error(f"unknown: {' '.join(rest)}")
    if options.name == "silhouettes":
        tables = ROOT / "tests" / "paper" / "silhouettes" / "tables.py"
        sys.exit(subprocess.run([sys.executable, tables, "--programs", BUILD, *rest], check=False).returncode)
    if options.name in papers:
        bench = BUILD / "tests" / "paper" / papers[options.name] / f"{options.name}_bench"
        status = subprocess.run([bench, *rest], check=False).returncode
        if options.name != "multiview" or status:
            sys.exit(status)
        with tempfile.TemporaryDirectory(prefix="imprint-bench-") as folder:
            print("\nRendered, the thesis's estimators with its own edge filter (orientation):")
            bench_rendered_multiview(pathlib.Path(folder) / "session", options)
            print("\nRendered bars with faces:")
            bench_rendered_bars(pathlib.Path(folder) / "session", options)
        return
    for name, bench in (("stages", bench_stages), ("latency", bench_latency), ("accuracy", bench_accuracy)):
        if options.name in (None, name):
            print(f"== {name}")
            with tempfile.TemporaryDirectory(prefix="imprint-bench-") as folder:
                bench(pathlib.Path(folder) / "session", options)


if __name__ == "__main__":
    main()
