#!/usr/bin/env python3
"""Checks the layers: lib <- node, lib <- fusion; node and fusion never meet; lib, node <- survey; protobuf only in lib/wire, Zenoh only in
lib/transport; the renderer and the estimators know nothing of each other."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# folder -> folders it must not include
FORBIDDEN = {
    "lib": ["node", "fusion", "survey", "cli", "simulation"],
    "node": ["fusion", "survey", "cli"],
    "fusion": ["node", "survey", "cli", "simulation"],
    "survey": ["fusion", "cli", "simulation"],
    "simulation": ["node", "fusion", "survey", "cli"],
}
# text in an include -> the only folder that may have it
ONLY_IN = {"google/protobuf": "lib/wire", ".pb.h": "lib/wire", "zenoh_bridge": "lib/transport"}
# the only place of the node that may know of the renderer: the simulated camera
RENDERER_USERS = "node/capture/"


def faults():
    for top, forbidden in FORBIDDEN.items():
        for path in sorted((ROOT / top).rglob("*.[ch]*")):
            name = path.relative_to(ROOT).as_posix()
            if path.suffix not in (".h", ".cc"):
                continue
            for number, line in enumerate(path.read_text().splitlines(), 1):
                found = re.match(r'#include ["<]([^">]+)[">]', line)
                if not found:
                    continue
                target = found.group(1)
                if any(target.startswith(folder + "/") for folder in forbidden):
                    yield f"{name}:{number}: {top} must not include {target}"
                if top == "node" and target.startswith("simulation/") and not name.startswith(RENDERER_USERS):
                    yield f"{name}:{number}: only {RENDERER_USERS} may include {target}"
                for text, place in ONLY_IN.items():
                    if text in target and not name.startswith(place):
                        yield f"{name}:{number}: only {place} may include {target}"


if __name__ == "__main__":
    found = list(faults())
    print("\n".join(found) or "layers are clean")
    sys.exit(1 if found else 0)
