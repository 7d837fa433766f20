#!/usr/bin/env python3
"""Builds the Zenoh bridge with cargo and hands its outputs to Meson.

Copies the static library, the generated header and cxx.h only when they changed, so that nothing is
relinked for nothing, and writes a depfile naming the Rust sources. Run by meson.build beside it.
"""

import argparse
import filecmp
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

OLDEST_CARGO = (1, 88)
# The first in PATH, then where Debian's cargo-web and rustc-web put theirs (as plain cargo and rustc).
CARGO_CANDIDATES = ("cargo", "/usr/bin/cargo")


def cargo_version(cargo):
    """(major, minor), or None when it is not there or does not run."""
    try:
        said = subprocess.run([cargo, "--version"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    found = re.search(r"(\d+)\.(\d+)", said)
    return (int(found[1]), int(found[2])) if found else None


def find_cargo(candidates):
    """Path of a cargo that is new enough; ends the build with one line when there is none."""
    seen = []
    for candidate in candidates:
        path = shutil.which(candidate)
        version = cargo_version(path) if path else None
        if version and version >= OLDEST_CARGO:
            return path
        if version:
            seen.append(f"{path} {version[0]}.{version[1]}")
    wanted = ".".join(map(str, OLDEST_CARGO))
    sys.exit(f"zenoh bridge: cargo {wanted} or newer is needed, found {', '.join(seen) or 'none'}: "
             "install the packages cargo-web and rustc-web, or Rust from its own site")


def run_cargo(args):
    """Builds; returns the static library, cargo's dep-info file and the folder of the generated headers."""
    # For another machine Debian's own first: the sysroot has the standard library of its version.
    cargo = find_cargo(reversed(CARGO_CANDIDATES) if args.target else CARGO_CANDIDATES)
    env = dict(os.environ)
    if args.target:
        name = args.target.replace("-", "_")
        env |= {f"CXX_{name}": args.cxx, f"CC_{name}": re.sub(r"g\+\+", "gcc", args.cxx),
                f"CARGO_TARGET_{name.upper()}_RUSTFLAGS": f"--sysroot={args.sysroot}/usr"}
    else:
        env["CXX"] = args.cxx
    # A cargo beside its own rustc: an older pair may come first in PATH.
    env["PATH"] = os.pathsep.join([os.path.dirname(cargo), env.get("PATH", "")])
    command = [cargo, "build", "--locked", "--manifest-path", args.manifest, "--target-dir", args.target_dir,
               "--profile", args.profile, "--message-format", "json-render-diagnostics"]
    command += ["--target", args.target] if args.target else []
    library = headers = None
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            message = json.loads(line)
            if message.get("manifest_path") == args.manifest and message["reason"] == "compiler-artifact":
                library = next((f for f in message["filenames"] if f.endswith(".a")), library)
            if message["reason"] == "build-script-executed" and args.crate in message["package_id"]:
                headers = pathlib.Path(message["out_dir"]) / "cxxbridge" / "include"
    if process.returncode:
        sys.exit(process.returncode)
    if not library or not headers:
        sys.exit(f"zenoh bridge: cargo named no static library of crate {args.crate}")
    library = pathlib.Path(library)
    return library, library.with_suffix(".d"), headers


def copy_if_changed(source, destination):
    destination.parent.mkdir(parents=True, exist_ok=True)
    if not (destination.exists() and filecmp.cmp(source, destination, shallow=False)):
        shutil.copyfile(source, destination)


def write_depfile(args, dep_info):
    """Makes Ninja run this script again when a Rust source or the manifest changes."""
    sources = dep_info.read_text().split("\n")[0].split(": ", 1)[1]
    folder = pathlib.Path(args.manifest).parent
    manifests = " ".join(str(folder / name).replace(" ", "\\ ") for name in ("Cargo.toml", "Cargo.lock"))
    args.depfile.write_text(f"{args.out_library}: {sources} {manifests}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--manifest", required=True, type=os.path.realpath)
    parser.add_argument("--crate", required=True)
    parser.add_argument("--target-dir", required=True, type=os.path.abspath)
    parser.add_argument("--profile", required=True)
    parser.add_argument("--cxx", required=True, help="the C++ compiler of the project")
    parser.add_argument("--target", help="the machine it is built for, as Rust names it (default: this one)")
    parser.add_argument("--sysroot", help="with --target: root folder of that machine's libraries")
    parser.add_argument("--out-library", required=True, type=pathlib.Path)
    parser.add_argument("--out-header", required=True, type=pathlib.Path)
    parser.add_argument("--depfile", required=True, type=pathlib.Path)
    args = parser.parse_args()

    library, dep_info, headers = run_cargo(args)
    copy_if_changed(library, args.out_library)
    copy_if_changed(headers / args.crate / "src" / "lib.rs.h", args.out_header)
    copy_if_changed(headers / "rust" / "cxx.h", args.out_header.parent / "rust" / "cxx.h")
    write_depfile(args, dep_info)


if __name__ == "__main__":
    main()
