"""The root file system of a board as a squashfs: Debian packages, the kernel's modules that boards need, the node.

Needs root. Times in it are SOURCE_DATE_EPOCH, the newest commit's: the same packages and programs give the same bytes.
"""
import os
import pathlib
import re
import shutil
import subprocess

from kernel_package import Modules

HERE = pathlib.Path(__file__).resolve().parent
SUITE = "bookworm"
TRIPLETS = {"amd64": "x86_64-linux-gnu", "arm64": "aarch64-linux-gnu"}
LEFT_OUT = ("doc", "man", "locale", "info", "lintian", "bash-completion", "zsh")


def run(*command, **options):
    return subprocess.run([str(word) for word in command], check=True, text=True, **options)


def listed(name):
    lines = (line.partition("#")[0].strip() for line in (HERE / name).read_text().splitlines())
    return [line for line in lines if line]


def locked(architecture):
    file = HERE / f"packages-{architecture}.lock"
    return dict(line.split("=", 1) for line in file.read_text().split()) if file.exists() else None


def installed(root):
    shown = run("dpkg-query", f"--admindir={root}/var/lib/dpkg", "-W", "-f", "${Package}=${Version}\n", capture_output=True).stdout
    return dict(line.split("=", 1) for line in shown.split())


def debootstrap(root, lock, architecture):
    """Installs the packages; with a lock exactly its versions. Those of another architecture are set up in qemu-user."""
    wanted = [f"{name}={lock[name]}" if lock else name for name in listed("packages.txt")]
    excluded = [f"--dpkgopt=path-exclude=/usr/share/{folder}/*" for folder in LEFT_OUT]
    mirror = os.environ.get("IMPRINT_DEBIAN_MIRROR")
    run("mmdebstrap", "--quiet", f"--architectures={architecture}", "--variant=minbase", "--aptopt=APT::Install-Recommends \"false\"", *excluded,
        "--include=" + ",".join(wanted), SUITE, root, *([mirror] if mirror else []))
    for name in listed("dropped.txt"):
        run("dpkg", f"--root={root}", "--purge", "--force-depends", "--force-remove-essential", name,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def check_lock(root, lock, architecture):
    found = installed(root)
    if lock is None:
        text = "".join(f"{name}={version}\n" for name, version in sorted(found.items()))
        (HERE / f"packages-{architecture}.lock").write_text(text)
        return
    changed = sorted(set(found.items()) ^ set(lock.items()))
    if changed:
        raise RuntimeError(f"packages-{architecture}.lock names other packages than were installed: "
                           f"{', '.join('='.join(entry) for entry in changed[:6])}; with IMPRINT_DEBIAN_MIRROR naming an "
                           "archive of that day they are, or delete the lock to take today's")


# What has to be there to reach the root, on virtual machines and on boards with NVMe, SATA, eMMC or USB.
TO_THE_ROOT = ("virtio_pci", "virtio_blk", "nvme", "ahci", "sd_mod", "xhci_pci", "usb_storage", "sdhci_pci", "sdhci_acpi",
               "mmc_block", "squashfs")


def make_initrd(kernel, busybox, target):
    root = target.with_suffix(".initrd")
    shutil.rmtree(root, ignore_errors=True)
    for folder in ("bin", "dev", "proc", "sys", "root", "modules"):
        (root / folder).mkdir(parents=True)
    shutil.copy(busybox, root / "bin/busybox")
    shutil.copy(HERE / "initrd.sh", root / "init")
    (root / "init").chmod(0o755)
    modules = Modules(kernel)
    files = modules.named(TO_THE_ROOT)
    for file in files:
        shutil.copy(modules.folder / file, root / "modules")
    (root / "modules.list").write_text("".join(pathlib.Path(file).name + "\n" for file in files))
    # One time for all commits: the same kernel gives the same initrd, and an update need not fetch it.
    run("sh", "-c", f"find . -exec touch -hd @0 {{}} + && find . -print0 | LC_ALL=C sort -z | "
        f"cpio --quiet --reproducible -o0 -R 0:0 -H newc | gzip -9n >'{target}'", cwd=root)
    shutil.rmtree(root)


def add_kernel(root, kernel, busybox):
    modules = Modules(kernel)
    target = root / "usr/lib/modules" / modules.folder.name
    for file in modules.below(listed("modules.txt")):
        (target / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(modules.folder / file, target / file)
    for name in ("modules.order", "modules.builtin", "modules.builtin.modinfo"):
        shutil.copy(modules.folder / name, target / name)
    run("depmod", "-b", root, modules.folder.name)
    (root / "boot").mkdir(exist_ok=True)
    shutil.copy(next((kernel / "boot").glob("vmlinuz-*")), root / "boot/vmlinuz")
    make_initrd(kernel, busybox, root / "boot/initrd")


def add_own(root, programs, version, keyring, architecture):
    shutil.copytree(HERE / "root", root, dirs_exist_ok=True, symlinks=True)
    for program in programs:
        run(f"{TRIPLETS[architecture]}-strip", "-o", root / "usr/bin" / program.name, program)
    for folder in ("data", "boot/efi", "etc/rauc"):
        (root / folder).mkdir(parents=True, exist_ok=True)
    rauc = root / "etc/rauc/system.conf"
    rauc.write_text(rauc.read_text().replace("ARCHITECTURE", architecture))
    shutil.copy(keyring, root / "etc/rauc/keyring.pem")
    (root / "etc/imprint-version").write_text(version + "\n")
    (root / "etc/machine-id").write_text("uninitialized\n")
    (root / "etc/hostname").write_text("imprint-board\n")
    (root / "etc/resolv.conf").unlink(missing_ok=True)
    (root / "etc/resolv.conf").symlink_to("/run/imprint/resolv.conf")
    run("systemd-sysusers", f"--root={root}", root / "usr/lib/sysusers.d/imprint.conf")
    run("systemctl", f"--root={root}", "enable", "imprint-board.service", "imprint-node.service", "imprint-good.service", "imprint-update.path",
        "systemd-networkd.service", "chrony.service", stderr=subprocess.DEVNULL)
    run("systemctl", f"--root={root}", "mask", "getty@tty1.service", "apt-daily.timer", "apt-daily-upgrade.timer",
        "dpkg-db-backup.timer", "e2scrub_all.timer", "fstrim.timer", "rauc-mark-good.service",
        stderr=subprocess.DEVNULL)


def bill_of_materials(root, version, target):
    """SPDX lines of every package in the root, with its version."""
    lines = ["SPDXVersion: SPDX-2.3", "DataLicense: CC0-1.0", "SPDXID: SPDXRef-DOCUMENT", f"DocumentName: imprint-board-{version}",
             f"DocumentNamespace: urn:imprint:board:{version}", "Creator: Tool: deploy/image/make_root.py", ""]
    for name, found in sorted({**installed(root), "imprint": version}.items()):
        lines += [f"PackageName: {name}", f"SPDXID: SPDXRef-{re.sub('[^A-Za-z0-9.-]', '-', name)}", f"PackageVersion: {found}",
                  f"ExternalRef: PACKAGE-MANAGER purl pkg:deb/debian/{name}@{found}" if name != "imprint" else "PackageSupplier: NOASSERTION",
                  "PackageDownloadLocation: NOASSERTION", ""]
    target.write_text("\n".join(lines))


def slim(root, architecture):
    for place in ("var/cache/apt", "var/cache/ldconfig", "var/lib/apt", "var/log", "usr/share/doc", "usr/share/man", "usr/share/locale",
                  "usr/lib/udev/hwdb.d", "usr/share/zoneinfo/right", "usr/share/zoneinfo/posix"):
        shutil.rmtree(root / place, ignore_errors=True)
    for place in ("usr/lib/udev/hwdb.bin", f"usr/lib/{TRIPLETS[architecture]}/gconv", "usr/share/grub", "usr/lib/grub"):
        shutil.rmtree(root / place) if (root / place).is_dir() else (root / place).unlink(missing_ok=True)
    for program in (root / "usr/bin").glob("grub-*"):  # of GRUB's tools RAUC uses one
        if program.name != "grub-editenv":
            program.unlink()
    for folder in ("var/log", "var/lib/apt", "tmp"):
        (root / folder).mkdir(parents=True, exist_ok=True)


def make_root(work, kernel, busybox, architecture, programs, version, keyring):
    """Gives the squashfs; beside it the bill of materials and the size of its content in MB."""
    root = work / "root"
    shutil.rmtree(root, ignore_errors=True)
    lock = locked(architecture)
    debootstrap(root, lock, architecture)
    check_lock(root, lock, architecture)
    bill_of_materials(root, version, work / "sbom.spdx")
    slim(root, architecture)
    add_kernel(root, kernel, busybox)
    add_own(root, programs, version, keyring, architecture)
    return pack_root(root, work / "root.squashfs")


def pack_root(root, image):
    size_mb = sum(f.lstat().st_size for f in root.rglob("*") if f.is_file() and not f.is_symlink()) / 1e6
    image.unlink(missing_ok=True)
    environment = {key: value for key, value in os.environ.items() if key != "SOURCE_DATE_EPOCH"}
    epoch = os.environ["SOURCE_DATE_EPOCH"]
    # gzip: what GRUB reads.
    run("mksquashfs", root, image, "-comp", "gzip", "-Xcompression-level", "6", "-noappend", "-no-progress", "-quiet",
        "-all-time", epoch, "-mkfs-time", epoch, env=environment)
    return image, size_mb
