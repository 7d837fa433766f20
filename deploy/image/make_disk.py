"""A disk to flash: boot partition with GRUB, two slots for the root, a data partition. No loop device is needed."""
import pathlib
import shutil

from kernel_package import run

HERE = pathlib.Path(__file__).resolve().parent
ESP_MB, SLOT_MB = 32, 400
GRUB_MODULES = ("part_gpt", "fat", "squash4", "normal", "configfile", "linux", "loadenv", "test", "echo", "serial", "terminal",
                "search", "search_label", "sleep", "reboot", "boot", "regexp", "efi_gop")


LOADERS = {"amd64": ("x86_64-efi", "BOOTX64.EFI"), "arm64": ("arm64-efi", "BOOTAA64.EFI")}


def make_esp(image, work, board_options, architecture, grub):
    target, loader = LOADERS[architecture]
    run("grub-mkimage", "-O", target, "-d", grub / target, "-o", work / loader, "-c", HERE / "grub_early.cfg", "-p", "/grub", *GRUB_MODULES)
    environment = work / "grubenv"
    environment.unlink(missing_ok=True)
    run("grub-editenv", environment, "create")
    run("grub-editenv", environment, "set", "ORDER=A B", "A_OK=1", "A_TRY=0", "B_OK=0", "B_TRY=0")
    image.unlink(missing_ok=True)
    run("truncate", "-s", f"{ESP_MB}M", image)
    run("mkfs.vfat", "-n", "ESP", "-i", "494d5052", image, capture_output=True)
    run("mmd", "-i", image, "::EFI", "::EFI/BOOT", "::grub")
    run("mcopy", "-i", image, work / loader, "::EFI/BOOT/")
    run("mcopy", "-i", image, HERE / "grub.cfg", environment, board_options, "::grub/")


def make_data(image, work, board, size_mb):
    """`board`: a folder with board.toml, identity/ and rig/; without it the board waits for one (docs/boards.md)."""
    tree = work / "data"
    shutil.rmtree(tree, ignore_errors=True)
    for folder in ("board", "imprint", "chrony", "update"):
        (tree / folder).mkdir(parents=True)
    if board:
        shutil.copytree(board, tree / "board", dirs_exist_ok=True)
    image.unlink(missing_ok=True)
    run("mke2fs", "-q", "-t", "ext4", "-L", "data", "-E", "root_owner=0:0", "-d", tree, image, f"{size_mb}M")


def make_disk(disk, root, work, board, board_options, data_mb, architecture="amd64", grub=pathlib.Path("/usr/lib/grub")):
    """`grub`: the folder with its modules of this architecture."""
    if root.stat().st_size > SLOT_MB << 20:
        raise RuntimeError(f"the root takes {root.stat().st_size >> 20} MB, a slot has {SLOT_MB}")
    make_esp(work / "esp.img", work, board_options, architecture, grub)
    make_data(work / "data.img", work, board, data_mb)
    disk.unlink(missing_ok=True)
    run("truncate", "-s", f"{ESP_MB + 2 * SLOT_MB + data_mb + 2}M", disk)
    run("sgdisk", "-n", f"1:2048:+{ESP_MB}M", "-t", "1:ef00", "-c", "1:esp", "-n", f"2:0:+{SLOT_MB}M", "-t", "2:8300", "-c", "2:rootfsA",
        "-n", f"3:0:+{SLOT_MB}M", "-t", "3:8300", "-c", "3:rootfsB", "-n", f"4:0:+{data_mb}M", "-t", "4:8300", "-c", "4:data", disk,
        capture_output=True)
    for image, at_mb in ((work / "esp.img", 1), (root, 1 + ESP_MB), (work / "data.img", 1 + ESP_MB + 2 * SLOT_MB)):
        run("dd", f"if={image}", f"of={disk}", "bs=1M", f"seek={at_mb}", "conv=notrunc,sparse", "status=none")
