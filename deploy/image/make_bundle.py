"""A signed RAUC bundle of a root: what an update is."""
import shutil

from kernel_package import run


def make_bundle(bundle, root, work, compatible, version, certificate, key):
    folder = work / "bundle"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    shutil.copy(root, folder / "rootfs.img")
    (folder / "manifest.raucm").write_text(f"[update]\ncompatible={compatible}\nversion={version}\n[bundle]\nformat=verity\n"
                                           "[image.rootfs]\nfilename=rootfs.img\n")
    bundle.unlink(missing_ok=True)
    # What is in it is compressed already.
    run("rauc", "bundle", "--mksquashfs-args=-noD -noF -noI", f"--cert={certificate}", f"--key={key}", folder, bundle,
        capture_output=True)
    shutil.rmtree(folder)


def make_thin(bundle, certificate, key):
    """What fetches only what a board does not have: an index, and beside it the store of the root's pieces (casync)."""
    thin = bundle.with_suffix(".thin.raucb")
    thin.unlink(missing_ok=True)
    shutil.rmtree(thin.with_suffix(".castr"), ignore_errors=True)
    run("rauc", "convert", f"--cert={certificate}", f"--key={key}", f"--keyring={certificate}", bundle, thin, capture_output=True)


def make_development_keys(folder):
    """A key to try with; a plant signs with its own, kept apart from what it builds with."""
    if (folder / "key.pem").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    run("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "3650", "-subj",
        "/CN=imprint development bundles", "-keyout", folder / "key.pem", "-out", folder / "cert.pem", capture_output=True)
