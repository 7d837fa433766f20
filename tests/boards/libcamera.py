#!/usr/bin/env python3
"""libcamera in guests: tests/boards/libcamera_test.cc with Debian 12's 0.0.3 and the kernel's vimc driver, built here as
Debian does not ship it, and with Debian 13's 0.4 and its backports' 0.7, which have a virtual pipeline.
"""
import pathlib
import re
import shutil
import subprocess
import sys

import guest

TIMEOUT_S = 900
LIBRARIES = "usr/lib/x86_64-linux-gnu"
VIMC = "drivers/media/test-drivers/vimc"
VIRTUAL_CAMERAS = """%YAML 1.1
---
"Virtual0":
  supported_formats:
  - width: 4656
    height: 3520
    frame_rates:
    - 30
    - 60
  test_pattern: "bars"
  location: "CameraLocationFront"
  model: "Virtual Video Device"
"Virtual1":
  supported_formats:
  - width: 1280
    height: 720
    frame_rates:
    - 30
    - 60
  test_pattern: "bars"
  location: "CameraLocationFront"
  model: "Virtual Video Device"
"""


def build_vimc(kernel):
    """The driver, against the headers of that very kernel."""
    release = next((kernel / "lib/modules").iterdir()).name
    headers = pathlib.Path("/usr/src") / f"linux-headers-{release}"
    if not headers.is_dir():
        raise RuntimeError(f"no {headers}: install linux-headers-{release}, or delete {kernel} to take the newest kernel")
    archive = next(pathlib.Path("/usr/src").glob(f"linux-source-{'.'.join(release.split('.')[:2])}.tar.*"))
    work = guest.CACHE / f"vimc-{release}"
    module = work / VIMC / "vimc.ko"
    if not module.exists():
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir(parents=True)
        guest.run("tar", "-xf", archive, "-C", work, "--strip-components=1", "--wildcards", f"linux-source-*/{VIMC}/*")
        guest.run("make", "-s", "-C", headers, f"M={work / VIMC}", "CONFIG_VIDEO_VIMC=m", "modules")
    needs = guest.run("modinfo", "-F", "depends", module, capture_output=True).stdout.strip().replace("-", "_").split(",")
    return module, needs


def old_libcamera(build):
    """0.0.3, as the program was built with; it takes cameras that udev knows."""
    kernel = guest.kernel_package.fetch_kernel(guest.CACHE)
    module, needs = build_vimc(kernel)
    program = pathlib.Path(build) / "tests/boards/libcamera_guest_test"
    ipa = {file: file for file in (f"/{LIBRARIES}/libcamera/ipa_vimc.so", f"/{LIBRARIES}/libcamera/ipa_vimc.so.sign",
                                   "/usr/share/libcamera/ipa/vimc/vimc.conf")}
    script = ("mkdir -p /run/udev; ln -s udevadm /bin/systemd-udevd; systemd-udevd --daemon\n"
              "insmod /modules/vimc.ko; udevadm trigger --action=add; udevadm settle\n"
              f"{program.name} --use-colour no --durations yes '[vimc]'\n")
    return kernel, {name: "" for name in needs}, [program, pathlib.Path("/bin/udevadm")], script, {"/modules/vimc.ko": module, **ipa}, \
        guest.shared_libraries


def fetch_new_libcamera(version, suite):
    """Debian 13's kernel, and libcamera with all that needs."""
    root = guest.CACHE / f"libcamera-{version}"
    if root.is_dir():
        return root
    part = root.with_suffix(".part")
    shutil.rmtree(part, ignore_errors=True)
    listed = guest.run("apt-cache", "policy", capture_output=True).stdout
    mirror = re.search(r"(https?://\S+) \w+/main", listed).group(1)
    wanted = [f"{name}/{suite}" for name in ("libcamera-dev", "libcamera-ipa", f"libcamera{version}")]
    guest.run("mmdebstrap", "--quiet", "--variant=extract", "--include=" + ",".join([*wanted, "linux-image-amd64"]), "", part,
              f"deb {mirror} trixie main", f"deb {mirror} trixie-backports main")
    for file in (part / LIBRARIES / "pkgconfig").glob("libcamera*.pc"):
        file.write_text(file.read_text().replace("prefix=/usr\n", f"prefix={root}/usr\n"))
    part.rename(root)
    return root


def new_libcamera(version, suite, tests):
    """The same sources compiled with this version's headers, its libraries and those they need from Debian 13."""
    root = fetch_new_libcamera(version, suite)
    folder = guest.CACHE / f"libcamera-{version}-build"
    if not (folder / "build.ninja").exists():
        guest.run("meson", "setup", folder, guest.ROOT, f"-Dpkg_config_path={root / LIBRARIES / 'pkgconfig'}",
                  "-Dcpp_link_args=-Wl,--allow-shlib-undefined", stdout=subprocess.DEVNULL)
    guest.run("ninja", "-C", folder, "-j2", "tests/boards/libcamera_guest_test", stdout=subprocess.DEVNULL)
    program = folder / "tests/boards/libcamera_guest_test"
    loader = root / LIBRARIES / "ld-linux-x86-64.so.2"

    def libraries_of(file):
        listing = guest.run(loader, "--library-path", f"{root / LIBRARIES}:/{LIBRARIES}:/lib/x86_64-linux-gnu", "--list", file,
                            capture_output=True).stdout
        found = dict(re.findall(r"(\S+) => (/\S+)", listing))
        if not str(found[f"libcamera.so.{version}"]).startswith(str(root)):
            raise RuntimeError(f"{file}: expected libcamera {version} of {root}, found {found[f'libcamera.so.{version}']}")
        return {f"/{LIBRARIES}/{name}": place for name, place in found.items() if not name.startswith("/")}

    cameras = guest.CACHE / "virtual.yaml"
    cameras.write_text(VIRTUAL_CAMERAS)
    files = {"/lib64/ld-linux-x86-64.so.2": loader, "/usr/share/libcamera/pipeline/virtual/virtual.yaml": cameras}
    return root, {}, [program], f"{program.name} --use-colour no --durations yes '{tests}'\n", files, libraries_of


VERSIONS = {
    "0.0.3 with vimc": old_libcamera,
    "0.4 with its virtual pipeline": lambda _: new_libcamera("0.4", "trixie", "[virtual]~[counts]"),  # which says neither time nor sequence
    "0.7 with its virtual pipeline": lambda _: new_libcamera("0.7", "trixie-backports", "[virtual]"),
}


def main(build):
    status = 0
    for name, prepare in VERSIONS.items():
        kernel, *content = prepare(build)
        archive = guest.CACHE / "libcamera.cpio.gz"
        guest.make_initramfs(archive, kernel, *content)
        printed, code, took_s = guest.boot(kernel, archive, guest.CACHE / f"libcamera-{name.split()[0]}.log", TIMEOUT_S)
        print(printed if code != 0 else printed[printed.rfind("====") :].strip())
        print(f"libcamera {name}: status {code} after {took_s:.0f} s")
        status = status or (0 if code == 0 else 1)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
