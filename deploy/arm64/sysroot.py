#!/usr/bin/env python3
"""The libraries and headers of an arm64 board, Debian's own packages unpacked: what `./dev build-arm64` compiles against.

    sysroot.py FOLDER PACKAGE...    makes FOLDER unless it is there with these packages, and FOLDER.ini for Meson
"""
import pathlib
import shutil
import subprocess
import sys

SUITE = "bookworm"
# Beside the libraries: the compiler's own, and Rust's standard library of the version that Debian's rustc-web is.
COMPILERS = ("libc6-dev", "libstdc++-12-dev", "libstd-rust-web-dev")
# Chosen on an installed system by update-alternatives, which does not run here.
ALTERNATIVES = {"libblas.so.3": "atlas", "liblapack.so.3": "atlas"}


def make_links_relative(root):
    """Links to absolute paths mean those of the sysroot, not of the machine that compiles."""
    for link in root.rglob("*"):
        if link.is_symlink() and link.readlink().is_absolute():
            target = root / link.readlink().relative_to("/")
            if target.exists():
                link.unlink()
                link.symlink_to(pathlib.Path(*[".."] * (len(link.relative_to(root).parts) - 1)) / target.relative_to(root))


def make_sysroot(root, packages):
    wanted = sorted({*packages, *COMPILERS})
    stamp = root / "packages.list"
    if stamp.exists() and stamp.read_text().split() == wanted:
        return
    shutil.rmtree(root, ignore_errors=True)
    root.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mmdebstrap", "--quiet", "--architectures=arm64", "--variant=extract", "--include=" + ",".join(wanted), SUITE, root],
                   check=True)
    libraries = root / "usr/lib/aarch64-linux-gnu"
    for name, folder in ALTERNATIVES.items():
        if not (libraries / name).exists():
            (libraries / name).symlink_to(f"{folder}/{name}")
    make_links_relative(root)
    root.with_suffix(".ini").write_text(f"[constants]\nsysroot = '{root.absolute()}'\n")
    stamp.write_text("\n".join(wanted) + "\n")


if __name__ == "__main__":
    make_sysroot(pathlib.Path(sys.argv[1]), sys.argv[2:])
