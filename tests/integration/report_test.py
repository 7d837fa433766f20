"""`imprint report`: the page says what the result says, read off by a parser that knows nothing of its making.

Meson passes the program in the environment: IMPRINT.
"""
import json
import math
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

IMPRINT = os.environ["IMPRINT"]
XHTML, SVG = "{http://www.w3.org/1999/xhtml}", "{http://www.w3.org/2000/svg}"
DRAWN_PX = 0.006  # coordinates are written to 0.01 px
HOSTILE = "</script><script>alert('x')</script>&<!-- \u2028 \u0001"


def result(session="S-7", camera="cam1"):
    sections = []
    for i in range(500):
        s = 3.0 * i
        y, z = 4.0 * math.sin(math.pi * i / 499), -1.5 * math.sin(2 * math.pi * i / 499)
        sections.append({"s_mm": s, "axis_mm": [s, y, z], "deflection_mm": math.hypot(y, z),
                         "diameter_mm": 250.0 + 20.0 * (i > 200) + 0.001 * i, "circularity_mm": 1.0 + 0.002 * i,
                         "axis_ci95_mm": 0.3, "diameter_ci95_mm": 0.4, "circularity_ci95_mm": 0.2})
    worst = max(sections, key=lambda section: section["deflection_mm"])
    cameras = [{"id": camera, "center_mm": [1, 2, 3], "R_cam_world": [1, 0, 0, 0, 1, 0, 0, 0, 1], "reprojection_rms_px": 0.0871,
                "targets_used": 23, "edge_points": 5501, "excluded": False},
               {"id": "cam2", "center_mm": [1, 2, 3], "R_cam_world": [1, 0, 0, 0, 1, 0, 0, 0, 1], "reprojection_rms_px": 0.0,
                "targets_used": 2, "edge_points": 0, "excluded": True, "reason": "too few targets"}]
    return {"schema": "imprint.result/1", "session": session, "method": "best", "line": "plant/L1",
            "made_at": "2026-11-22T18:05:02.123Z", "length_mm": 1497.13, "length_ci95_mm": 0.61,
            "max_deflection_mm": worst["deflection_mm"], "max_deflection_at_mm": worst["s_mm"],
            "max_deflection_direction_deg": 0.0, "sections": sections,
            "alignment": {"R_forging_world": [1, 0, 0, 0, 1, 0, 0, 0, 1], "origin_world_mm": [0, 0, 0]},
            "observations": [{"index": 0, "rotation_deg": 60.0, "cameras": cameras}], "warnings": ["cam2 was left out"]}


def truth_of(measured):
    return {"schema": "imprint.truth/1", "length_mm": 1500.0, "max_deflection_mm": 4.0,
            "sections": [{"s_mm": s["s_mm"], "axis_mm": [s["s_mm"], 0.0, 0.0], "diameter_mm": 255.0, "circularity_mm": 1.0}
                         for s in measured["sections"]]}


class Figure:
    """A plot, read as a person does: by its grid and the numbers beside it."""

    def __init__(self, page, figure_id):
        figure = page.find(f".//{XHTML}figure[@id='{figure_id}']")
        lines = [e for e in figure.iter(SVG + "line")]
        texts = [e for e in figure.iter(SVG + "text")]
        self.curves = {e.get("class"): [tuple(map(float, p.split(","))) for p in e.get("points").split()]
                       for e in figure.iter() if e.tag in (SVG + "polyline", SVG + "polygon")}
        across = {float(e.get("y1")) for e in lines if e.get("y1") == e.get("y2")}
        along = {float(e.get("x1")) for e in lines if e.get("x1") == e.get("x2")}
        self.y_scale = self.scale(across, [(float(e.get("y")) - 5.0, e) for e in texts if e.get("text-anchor") == "end"])
        self.x_scale = self.scale(along, [(float(e.get("x")), e) for e in texts if e.get("text-anchor") == "middle"])

    @staticmethod
    def scale(grid, labelled):
        """Value at px 0 and value a px, from the first and the last labelled line."""
        marks = sorted((px, float(e.text)) for px, e in labelled if any(abs(px - line) < DRAWN_PX for line in grid))
        (px_a, a), (px_b, b) = marks[0], marks[-1]
        slope = (b - a) / (px_b - px_a)
        return a - slope * px_a, slope

    def read(self, name):
        (x0, dx), (y0, dy) = self.x_scale, self.y_scale
        return [(x0 + dx * x, y0 + dy * y) for x, y in self.curves[name]]


class Report(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="imprint-report-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def report(self, document, out="report.html", truth=None, status=0):
        result_file = self.folder / "result.json"
        result_file.write_text(document if isinstance(document, str) else json.dumps(document), encoding="utf-8")
        command = [IMPRINT, "report", result_file, "--out", self.folder / out]
        if truth is not None:
            (self.folder / "truth.json").write_text(json.dumps(truth), encoding="utf-8")
            command += ["--truth", self.folder / "truth.json"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, status, done.stderr)
        return done

    def page(self, document, **options):
        self.report(document, **options)
        return ElementTree.parse(self.folder / "report.html").getroot()

    @staticmethod
    def rows(page, table):
        body = page.find(f".//{XHTML}table[@id='{table}']/{XHTML}tbody")
        return [["".join(cell.itertext()) for cell in row] for row in body]

    def test_table_holds_the_results_numbers(self):
        document = result()
        rows = {row[0].split(",")[0]: row[1:] for row in self.rows(self.page(document, truth=truth_of(document)), "results")}
        self.assertEqual(rows["length"], ["1497.13", "0.61", "1500.00", "-2.87"])
        worst = document["max_deflection_mm"]
        self.assertEqual(rows["largest deflection"], [f"{worst:.2f}", "0.30", "4.00", f"{worst - 4.0:+.2f}"])
        self.assertEqual(rows["smallest diameter"], ["250.00", "0.40", "255.00", "-5.00"])
        self.assertEqual(rows["largest diameter"], ["270.50", "0.40", "255.00", "+15.50"])
        self.assertEqual(rows["median circularity"], ["1.50", "0.20", "1.00", "+0.50"])

    def test_curves_read_off_the_grid_are_the_sections(self):
        document = result()
        page = self.page(document, truth=truth_of(document))
        for figure_id, value, ci95, true in (
                ("axis_xy", lambda s: s["axis_mm"][1], "axis_ci95_mm", 0.0), ("axis_xz", lambda s: s["axis_mm"][2], "axis_ci95_mm", 0.0),
                ("diameter", lambda s: s["diameter_mm"], "diameter_ci95_mm", 255.0),
                ("circularity", lambda s: s["circularity_mm"], "circularity_ci95_mm", 1.0)):
            figure = Figure(page, figure_id)
            x_tolerance, y_tolerance = 2 * DRAWN_PX * abs(figure.x_scale[1]), 2 * DRAWN_PX * abs(figure.y_scale[1])
            curve, band, reference = figure.read("curve"), figure.read("band"), figure.read("reference")
            self.assertEqual((len(curve), len(band), len(reference)), (500, 1000, 500))
            for i, section in enumerate(document["sections"]):
                self.assertAlmostEqual(curve[i][0], section["s_mm"], delta=x_tolerance)
                self.assertAlmostEqual(curve[i][1], value(section), delta=y_tolerance)
                self.assertAlmostEqual(band[i][1], value(section) + section[ci95], delta=y_tolerance)
                self.assertAlmostEqual(band[-1 - i][1], value(section) - section[ci95], delta=y_tolerance)
                self.assertAlmostEqual(reference[i][1], true, delta=y_tolerance)

    def test_heading_cameras_and_warnings_are_there(self):
        page = self.page(result())
        self.assertEqual([e.text for e in page.iter(XHTML + "dd")], ["plant/L1", "S-7", "2026-11-22T18:05:02.123Z", "best"])
        used, left_out, reason = self.rows(page, "cameras")
        self.assertEqual(used, ["0", "60.0°", "cam1", "used", "23", "0.087", "5501"])
        self.assertEqual(left_out[2:5], ["cam2", "left out", "2"])
        self.assertEqual(reason[-1], "too few targets")
        warnings = page.find(f".//{XHTML}div[@id='warnings']")
        self.assertEqual([e.text for e in warnings.iter(XHTML + "li")], ["cam2 was left out"])

    def test_embedded_document_is_the_file(self):
        document = result()
        document["of_a_later_version"] = {"x": [1, 2.5, None]}
        self.assertEqual(json.loads(self.page(document).find(f".//{XHTML}script[@id='result']").text), document)

    def test_no_text_breaks_out_of_its_place(self):
        document = result(session=HOSTILE, camera=HOSTILE)
        document["warnings"] = [HOSTILE]
        page = self.page(document)  # parsed, so well-formed
        self.assertEqual(len(list(page.iter(XHTML + "script"))), 1)
        text = (self.folder / "report.html").read_text(encoding="utf-8")
        self.assertEqual((text.count("<script"), text.count("</script"), text.count("<!--")), (1, 1, 0))
        self.assertEqual(json.loads(page.find(f".//{XHTML}script[@id='result']").text)["session"], HOSTILE)

    def test_a_name_in_txt_gives_the_table(self):
        done = self.report(result(), out="report.txt")
        self.assertEqual((self.folder / "report.txt").read_text(encoding="utf-8"), done.stdout)
        self.assertIn("1497.13", done.stdout)

    def test_what_cannot_be_reported_is_said_and_nothing_is_written(self):
        self.assertIn("report.pdf: expected a name that ends in .html or .txt", self.report(result(), out="report.pdf", status=2).stderr)
        self.assertIn("no/report.html", self.report(result(), out="no/report.html", status=2).stderr)
        none = dict(result(), sections=[])
        for damaged in (none, dict(result(), length_mm="long"), "{", "", '{"schema": "imprint.result/1"}', "[1e999]", "null"):
            self.assertIn("result.json", self.report(damaged, status=2).stderr)
        self.assertEqual([path.name for path in self.folder.iterdir()], ["result.json"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
