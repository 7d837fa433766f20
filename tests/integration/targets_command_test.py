"""`imprint targets`: libraries, sheets read back from rasterised pages, debug pictures, and images nobody means to send.

Meson passes the program in the environment: IMPRINT.
"""
import json
import os
import pathlib
import random
import struct
import subprocess
import tempfile
import time
import unittest
import zlib

IMPRINT = os.environ["IMPRINT"]


def imprint(*arguments):
    return subprocess.run([IMPRINT, "targets", *map(str, arguments)], capture_output=True, text=True, check=False, timeout=300)


def write_png(path, width, height, rows, bits=8):
    """`rows`: the bytes of each row, 16 bit big-endian."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + row for row in rows), 1)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


def png_size(path):
    return struct.unpack(">II", path.read_bytes()[16:24])


class TargetsCommand(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="imprint-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def document(self, *arguments):
        done = imprint(*arguments, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def refused(self, *arguments):
        done = imprint(*arguments)
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        return done.stderr

    def library(self, *options):
        table, path = self.folder / "lookup.txt", self.folder / "library.json"
        table.write_text("11 300\n12 305\n13 325\n14 338\n")
        self.document("import", "--bits", 14, *options, table, "--out", path)
        return path

    def rasterised(self, pdf, dots_per_inch):
        subprocess.run(["pdftoppm", "-gray", "-png", "-r", str(dots_per_inch), pdf, self.folder / "page"], check=True)
        return sorted(self.folder.glob("page*.png"))

    def read_back(self, library, dots_per_inch, *options):
        """Every target of the sheet is seen on its page within 0.05 mm of where the command says that it is."""
        pdf = self.folder / "sheet.pdf"
        sheet = self.document("sheet", "--library", library, "--out", pdf, *options)
        pages = self.rasterised(pdf, dots_per_inch)
        self.assertEqual(len(pages), sheet["pages"])
        self.assertEqual(sum(sheet["targets_per_page"]), len(sheet["targets"]))
        images = self.document("detect", "--library", library, *pages)["images"]
        for number, image in enumerate(images, start=1):
            planned = {t["id"]: t for t in sheet["targets"] if t["page"] == number}
            self.assertEqual({t["id"] for t in image["targets"]}, set(planned))
            for seen in image["targets"]:
                for axis in "xy":  # the middle of the first pixel is half a pixel from the page's edge
                    self.assertAlmostEqual((seen[f"{axis}_px"] + 0.5) * 25.4 / dots_per_inch,
                                           planned[seen["id"]][f"{axis}_mm"], delta=0.05)
        return sheet

    def test_generated_library_is_printed_and_read_back(self):
        library = self.folder / "library.json"
        made = self.document("generate", "--bits", 8, "--count", 10, "--out", library)
        self.assertEqual(made["count"], 10)
        self.assertEqual(made["min_distance"], json.loads(library.read_text())["min_distance"])
        sheet = self.read_back(library, 100, "--dot-diameter-mm", 14, "--ids", "3,1,5-9")
        self.assertEqual([t["id"] for t in sheet["targets"]], [3, 1, 5, 6, 7, 8, 9])

    def test_imported_rings_of_other_radii_are_printed_and_read_back(self):
        library = self.library("--ring-inner-radius", 1.7, "--ring-outer-radius", 2.6)
        self.assertEqual(json.loads(library.read_text())["geometry"]["ring_outer_radius"], 2.6)
        self.read_back(library, 100, "--dot-diameter-mm", 20, "--page", "plate=140x150")

    def test_tables_that_are_wrong_are_refused_by_line(self):
        table, out = self.folder / "lookup.txt", self.folder / "library.json"
        for text, bits, words in (("1 3\n2\n", 14, [":2:", "id decimal-code"]), ("1 3\n1 7\n", 14, [":2:", "line 1"]),
                                  ("1 3\n2 6\n", 14, [":2:", "turned"]), ("1 16384\n", 14, [":1:", "16383"]),
                                  ("", 14, ["found none"]), ("1 3\n", 7, ["--bits 7"]), ("1 3\n", 21, ["--bits 21"])):
            table.write_text(text)
            message = self.refused("import", "--bits", bits, table, "--out", out)
            for word in words:
                self.assertIn(word, message)
        table.write_text("1 3\n")
        for inner, outer in ((1, 2), (3, 2), ("nan", 3)):
            self.assertIn("--ring-inner-radius", self.refused("import", "--bits", 14, "--ring-inner-radius", inner,
                                                              "--ring-outer-radius", outer, table, "--out", out))
        self.assertIn("none.txt", self.refused("import", "--bits", 14, self.folder / "none.txt", "--out", out))
        self.assertFalse(out.exists())

    def test_sheets_that_cannot_be_are_refused_and_nothing_is_written(self):
        library, out = self.library(), self.folder / "sheet.pdf"
        for options, word in ((["--dot-diameter-mm", 60], "--dot-diameter-mm"), (["--page", "A9"], "A9"),
                              (["--ids", "11,99"], "99"), (["--ids", "11-"], "--ids"), (["--margin-mm", 200], "--margin-mm"),
                              (["--page", "plate=100x100"], "--dot-diameter-mm")):
            self.assertIn(word, self.refused("sheet", "--library", library, "--out", out, *options))
        self.assertFalse(out.exists())
        self.assertIn("folder", self.refused("sheet", "--library", library, "--out", self.folder / "no/folder/sheet.pdf"))

    def test_debug_pictures_of_several_images_go_into_a_folder(self):
        library = self.library()
        images = [self.folder / "a.png", self.folder / "b.png"]
        for image in images:
            write_png(image, 200, 100, [bytes([90]) * 200] * 100)
        pictures = self.folder / "pictures"
        self.assertIn("folder", self.refused("detect", "--library", library, "--debug-image", pictures, *images))
        pictures.mkdir()
        self.document("detect", "--library", library, "--debug-image", pictures, *images)
        for name in ("a.png", "b.png"):
            width, height = png_size(pictures / name)
            self.assertEqual(width % 200, 0)  # enlarged by a whole factor
            self.assertGreater(height, 100 * width // 200)  # the legend stands below
        (self.folder / "c").mkdir()
        write_png(self.folder / "c" / "a.png", 200, 100, [bytes([90]) * 200] * 100)
        self.assertIn("a.png", self.refused("detect", "--library", library, "--debug-image", pictures, images[0],
                                            self.folder / "c" / "a.png"))
        self.assertIn("a.png", self.refused("detect", "--library", library, "--debug-image", self.folder, images[0]))

    def test_hostile_images_are_done_soon(self):
        library = self.library()
        noise = random.Random(3)
        wide = 2000
        cases = {"pixel": (1, 1, [b"\xff"], 8), "strip": (20000, 3, [noise.randbytes(20000)] * 3, 8),
                 "flat": (wide, wide, [b"\x80" * wide] * wide, 8),
                 "levels": (wide, 1000, [b"".join(noise.choices((b"\0\0", b"\x70\0", b"\xff\xff"), k=wide))
                                         for _ in range(1000)], 16)}
        for name, (width, height, rows, bits) in cases.items():
            image = self.folder / f"{name}.png"
            write_png(image, width, height, rows, bits)
            begin = time.monotonic()
            found = self.document("detect", "--library", library, "--debug-image", self.folder / f"{name}_seen.png", image)
            self.assertEqual(found["images"][0]["targets"], [], name)
            self.assertEqual(found["images"][0]["width_px"], width)
            self.assertLess(time.monotonic() - begin, 30.0, name)  # under a second when measured alone


if __name__ == "__main__":
    unittest.main()
