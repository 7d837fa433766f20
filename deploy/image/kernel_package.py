"""Debian's kernel: its package, fetched by apt and unpacked, and the modules in it with what they need."""
import fcntl
import pathlib
import re
import shutil
import subprocess

KERNEL = "linux-image-amd64"  # names the release's current kernel


def run(*command, **options):
    return subprocess.run([str(word) for word in command], check=True, text=True, **options)


def fetch_kernel(cache):
    """The unpacked package of the release's kernel. One at a time."""
    cache.mkdir(parents=True, exist_ok=True)
    with (cache / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return unpacked_kernel(cache)


def unpacked_kernel(cache):
    depends = run("apt-cache", "depends", KERNEL, capture_output=True).stdout
    package = re.search(r"Depends: (linux-image-\S+)", depends).group(1)
    folder = cache / package
    if not (folder / "boot").is_dir():
        work = cache / (package + ".part")
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir(parents=True)
        run("apt-get", "-q", "-o", "APT::Sandbox::User=root", "download", package, cwd=work, stdout=subprocess.DEVNULL)
        run("dpkg", "-x", next(work.glob("*.deb")), work / "tree")
        run("depmod", "-b", work / "tree", next((work / "tree/lib/modules").iterdir()).name)
        (work / "tree").rename(folder)
        shutil.rmtree(work)
    return folder


def fetch_foreign_boot(cache, architecture, suite):
    """For another architecture, whose packages apt does not know here: kernel, busybox and GRUB in one unpacked root."""
    folder = cache / architecture / "boot"
    if not folder.is_dir():
        part = folder.with_suffix(".part")
        shutil.rmtree(part, ignore_errors=True)
        part.parent.mkdir(parents=True, exist_ok=True)
        run("mmdebstrap", "--quiet", f"--architectures={architecture}", "--variant=extract",
            f"--include=linux-image-{architecture},busybox-static,grub-efi-{architecture}-bin", suite, part)
        run("depmod", "-b", part, next((part / "lib/modules").iterdir()).name)
        part.rename(folder)
    return folder


class Modules:
    """The kernel's modules and what they need."""

    def __init__(self, kernel):
        self.folder = next((kernel / "lib/modules").iterdir())
        self.needs = {}
        for line in (self.folder / "modules.dep").read_text().splitlines():
            path, _, others = line.partition(":")
            self.needs[path] = others.split()

    def with_needs(self, paths):
        """In an order in which they can be loaded."""
        order = dict.fromkeys(file for path in paths for file in [*reversed(self.needs[path]), path])
        return list(order)

    def below(self, places):
        return self.with_needs(sorted(path for path in self.needs
                                      if any(path == f"kernel/{place}" or path.startswith(f"kernel/{place}/") for place in places)))

    def named(self, names):
        places = {pathlib.Path(path).stem.replace("-", "_"): path for path in self.needs}
        return self.with_needs([places[name] for name in names if name in places])  # the others are built in
