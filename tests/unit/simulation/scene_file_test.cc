#include <fstream>
#include <sstream>

#include <catch2/catch.hpp>

#include "simulation/scene.h"
#include "simulation/simulation.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

std::string scene_text() {
  std::ostringstream text;
  text << std::ifstream(IMPRINT_TEST_DATA "/small_forge.toml").rdbuf();
  return text.str();
}

// The message for the small forge with one piece of its text replaced.
std::string fault_after(const std::string& piece, const std::string& replacement) {
  std::string text = scene_text();
  const auto at = text.find(piece);
  REQUIRE(at != std::string::npos);
  text.replace(at, piece.size(), replacement);
  const TemporaryFolder folder;
  const auto scene = read_scene(folder.write("scene.toml", text));
  REQUIRE_FALSE(scene);
  CHECK(scene.error().kind == ErrorKind::invalid_input);
  CHECK_THAT(scene.error().message, Catch::Contains("scene.toml"));
  CHECK_THAT(scene.error().message, !Catch::Contains("\n"));
  return scene.error().message;
}

int line_of(const std::string& piece) {
  const std::string text = scene_text();
  return 1 +
         static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find(piece)), '\n'));
}

}  // namespace

TEST_CASE("scene file: the ready scenes are read, each with three cameras") {
  for (const char* path : {IMPRINT_SCENES "/forge.toml", IMPRINT_SCENES "/laboratory.toml",
                           IMPRINT_TEST_DATA "/small_forge.toml", IMPRINT_TEST_DATA "/small_laboratory.toml"}) {
    const auto scene = read_scene(path);
    REQUIRE(scene);
    CHECK(scene->cameras.size() == 3);
    CHECK(scene->spec.polarity == (scene->kind == SceneKind::forge ? Polarity::bright : Polarity::dark));
  }
}

TEST_CASE("scene file: a value out of range is named by line and key") {
  const auto message = fault_after("bits = 8", "bits = 12");
  CHECK_THAT(message, Catch::Contains(fmt::format("scene.toml:{}:", line_of("bits = 8"))));
  CHECK_THAT(message, Catch::Contains("imaging.bits") && Catch::Contains("12"));
}

TEST_CASE("scene file: manipulator, V-blocks, other bodies and an empty hall are read, and their faults named") {
  const TemporaryFolder folder;
  const std::string more =
      "\n[jaw]\nholds = \"second\"\ncover_mm = 300.0\n[v_blocks]\nat_mm = [400.0, 1500.0]\n"
      "[[other]]\nshape = \"flat\"\ncenter_mm = [0.0, -900.0, 700.0]\nlevel = 0.5\n";
  std::string text = scene_text();
  const std::string key = "length_mm = 1900.0";
  text.insert(text.find(key), "present = false\n");
  const auto scene = read_scene(folder.write("scene.toml", text + more));
  REQUIRE(scene);
  CHECK_FALSE(scene->forging.present);
  CHECK(scene->jaw.holds == JawScene::End::second);
  CHECK(scene->jaw.cover_mm == 300.0);
  CHECK(scene->v_blocks.at_mm == std::vector<double>{400.0, 1500.0});
  REQUIRE(scene->others.size() == 1);
  CHECK(scene->others[0].flat);
  CHECK(scene->others[0].center_world_mm.y() == -900.0);

  const auto fault = [&](const std::string& piece, const std::string& replacement) {
    std::string changed = text + more;
    changed.replace(changed.find(piece), piece.size(), replacement);
    const auto read = read_scene(folder.write("scene.toml", changed));
    REQUIRE_FALSE(read);
    return read.error().message;
  };
  CHECK_THAT(fault("\"second\"", "\"middle\""), Catch::Contains("jaw.holds") && Catch::Contains("middle"));
  CHECK_THAT(fault("1500.0]\n[[other", "2500.0]\n[[other"),
             Catch::Contains("v_blocks.at_mm") && Catch::Contains("2500"));
  CHECK_THAT(fault("\"flat\"", "\"square\""), Catch::Contains("other[0].shape") && Catch::Contains("square"));
}

TEST_CASE("scene file: faults of every kind name their place") {
  CHECK_THAT(fault_after("blur_sigma_px", "blur_sigma"), Catch::Contains("imaging.blur_sigma: unknown key"));
  CHECK_THAT(fault_after("kind = \"forge\"", "kind = \"foundry\""), Catch::Contains("foundry"));
  CHECK_THAT(fault_after("[[0.0, 180.0], [170.0", "[[0.0, 180.0], [-170.0"), Catch::Contains("forging.stations"));
  CHECK_THAT(fault_after("[[0.0, 180.0]", "[[0.0, nan]"), Catch::Contains("forging.stations"));
  CHECK_THAT(fault_after("[[0.0, 180.0]", "[[0.0, 180.0, 3.0]"), Catch::Contains("forging.stations"));
  CHECK_THAT(fault_after("length_mm = 1900.0", "length_mm = \"long\""), Catch::Contains("forging.length_mm"));
  CHECK_THAT(fault_after("length_mm = 1900.0", "length_mm = inf"), Catch::Contains("forging.length_mm"));
  CHECK_THAT(fault_after("id = \"cam2\"", "id = \"cam1\""), Catch::Contains("twice"));
  CHECK_THAT(fault_after("id = \"cam2\"", "id = \"../cam2\""), Catch::Contains("id"));
  CHECK_THAT(fault_after("distance_mm = 7400.0", ""), Catch::Contains("camera[0].distance_mm: missing"));
  CHECK_THAT(fault_after("rotations_deg = [0.0, 60.0, 120.0]", "rotations_deg = []"),
             Catch::Contains("observations.rotations_deg"));
  CHECK_THAT(fault_after("bow_mm = 8.0", "faces = 5"), Catch::Contains("forging.faces"));
  CHECK_THAT(fault_after("bow_mm = 8.0", "faces = 4\ncorner_radius_mm = 90.0"),
             Catch::Contains("forging.corner_radius_mm"));
  CHECK_THAT(fault_after("end_section_mm = 80.0", "end_section_mm = 1200.0"), Catch::Contains("rig.end_section_mm"));
  CHECK_THAT(fault_after("[backdrop]", "[backdrop"), Catch::Contains("not valid TOML"));
  CHECK_THAT(fault_after("[backdrop]", "[hall]"), Catch::Contains("hall: unknown key"));
}

TEST_CASE("scene file: one that is missing or empty is an error, not a scene") {
  const TemporaryFolder folder;
  CHECK_FALSE(read_scene(folder / "none.toml"));
  const auto empty = read_scene(folder.write("empty.toml", ""));
  REQUIRE_FALSE(empty);
  CHECK_THAT(empty.error().message, Catch::Contains("scene.kind"));
}

}  // namespace imprint
