#!/usr/bin/env python3
"""./dev deb: the Debian package of a fusion host, imprint-fusion_<version>_<architecture>.deb.

The programs, the unit, the config template and what the libraries' own packages say they need (dpkg-shlibdeps). Times in
it are SOURCE_DATE_EPOCH, the newest commit's: the same programs give the same bytes.
"""
import argparse
import gzip
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MAINTAINER = "Imprint maintainers <maintainers@imprint.invalid>"


def output(*command, **options):
    return subprocess.run([str(word) for word in command], check=True, text=True, stdout=subprocess.PIPE, **options).stdout.strip()


def version_of_tree():
    """That of meson.build with the number of commits, so that a later build is a later version."""
    released = re.search(r"version: '([^']+)'", (ROOT / "meson.build").read_text()).group(1)
    commit = output("git", "-C", ROOT, "rev-parse", "--short=8", "HEAD")
    return f"{released}+{output('git', '-C', ROOT, 'rev-list', '--count', 'HEAD')}.{commit}"


def needed_packages(programs):
    """What the programs' libraries are packaged in, as a Depends line."""
    with tempfile.TemporaryDirectory() as work:
        (pathlib.Path(work) / "debian").mkdir()
        (pathlib.Path(work) / "debian/control").write_text("Source: imprint\n\nPackage: imprint-fusion\nArchitecture: any\n")
        line = output("dpkg-shlibdeps", "-O", *(f"-e{program}" for program in programs), cwd=work, stderr=subprocess.DEVNULL)
    return line.removeprefix("shlibs:Depends=")


def config_template():
    """deploy/fusion.toml with the places of an installed program."""
    text = (ROOT / "deploy/fusion.toml").read_text()
    for key, value in (("database", "/var/lib/imprint/imprint.db"), ("result_dir", "/var/lib/imprint/results")):
        text, found = re.subn(rf'^(# )?{key} = "[^"]*"', rf'\g<1>{key} = "{value}"' if key == "result_dir" else f'{key} = "{value}"',
                              text, flags=re.MULTILINE)
        if found != 1:
            raise RuntimeError(f"deploy/fusion.toml: expected one line {key} = \"...\", found {found}")
    return text.replace("Check with: imprint-fusion --config fusion.toml --check",
                        "Check with: imprint-fusion --config /etc/imprint/fusion.toml --check")


def add_files(root, programs, version, epoch):
    shutil.copytree(HERE / "root", root, dirs_exist_ok=True)
    (root / "usr/bin").mkdir(parents=True)
    for program in programs:
        subprocess.run(["strip", "--strip-unneeded", "-R", ".comment", "-o", root / "usr/bin" / program.name, program], check=True)
    (root / "etc/imprint").mkdir(parents=True)
    (root / "etc/imprint/fusion.toml").write_text(config_template())
    documents = root / "usr/share/doc/imprint-fusion"
    documents.mkdir(parents=True)
    for name in ("configuration.md", "security.md", "service.md"):
        shutil.copy(ROOT / "docs" / name, documents)
    (documents / "copyright").write_text(
        "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: Imprint\n\n"
        "Files: *\nCopyright: 2026 the Imprint authors\nLicense: Apache-2.0\n"
        " On Debian systems the full text is in /usr/share/common-licenses/Apache-2.0.\n")
    date = output("date", "-R", "-u", "-d", f"@{epoch}")
    log = f"imprint-fusion ({version}) unstable; urgency=medium\n\n  * docs/ and CHANGELOG.md of the source say what is new.\n\n -- {MAINTAINER}  {date}\n"
    with open(documents / "changelog.gz", "wb") as file, gzip.GzipFile("", "wb", 9, file, mtime=0) as packed:
        packed.write(log.encode())


def add_control(root, programs, version):
    control = root / "DEBIAN"
    shutil.copytree(HERE / "control", control)
    for name in ("postinst", "prerm", "postrm"):
        (control / name).chmod(0o755)
    size_kb = sum(path.stat().st_size for path in root.rglob("*") if path.is_file() and control not in path.parents) // 1024
    text = (control / "control").read_text()
    for name, value in (("VERSION", version), ("ARCHITECTURE", output("dpkg", "--print-architecture")), ("MAINTAINER", MAINTAINER),
                        ("SIZE_KB", size_kb), ("DEPENDS", needed_packages(programs))):
        text = text.replace(f"@{name}@", str(value))
    (control / "control").write_text(text)
    sums = "".join(f"{output('md5sum', path).split()[0]}  {path.relative_to(root)}\n"
                   for path in sorted(root.rglob("*")) if path.is_file() and control not in path.parents)
    (control / "md5sums").write_text(sums)


def make_deb(build, out, version):
    """Gives the package made of the programs in the build folder."""
    programs = [build / "fusion/imprint-fusion", build / "cli/imprint"]
    epoch = os.environ.get("SOURCE_DATE_EPOCH") or output("git", "-C", ROOT, "log", "-1", "--format=%ct")
    os.environ["SOURCE_DATE_EPOCH"] = epoch  # dpkg-deb's too
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        root = pathlib.Path(work) / "root"
        root.mkdir(mode=0o755)
        add_files(root, programs, version, epoch)
        add_control(root, programs, version)
        subprocess.run(["chmod", "-R", "u=rwX,go=rX", root], check=True)
        deb = out / f"imprint-fusion_{version}_{output('dpkg', '--print-architecture')}.deb"
        output("dpkg-deb", "-z3", "--root-owner-group", "--build", root, deb)
    return deb


def main():
    parser = argparse.ArgumentParser(prog="./dev deb", description="the Debian package of a fusion host")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build", help="folder the programs were built in")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/deb")
    parser.add_argument("--version", help="of the package (default: of the tree)")
    options = parser.parse_args()
    deb = make_deb(options.build.resolve(), options.out, options.version or version_of_tree())
    print(f"{deb}: {deb.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
