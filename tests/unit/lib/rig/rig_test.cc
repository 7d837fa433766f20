#include "lib/rig/rig.h"

#include <catch2/catch.hpp>

#include "lib/rig/session_file.h"
#include "tests/unit/temporary_folder.h"

using namespace imprint;
using Catch::Matchers::Contains;

namespace {

const std::string kLibrary = R"({"schema": "imprint.library/1", "bits": 5, "min_distance": 2,
  "geometry": {"dot_radius": 1.0, "ring_inner_radius": 2.0, "ring_outer_radius": 3.0},
  "codes": [{"id": 1, "code": "00011"}, {"id": 7, "code": "01011"}]})";
const std::string kField = "id,x_mm,y_mm,z_mm\n1,0,0,0\n7,100.5,-2,3e1\n";
const std::string kCamera =
    "[camera]\nid = \"cam1\"\nwidth_px = 100\nheight_px = 80\npixel_pitch_um = 3.8\n"
    "focal_length_px = 500.0\nprincipal_point_px = [50, 40]\n";
const std::string kRig =
    "field = \"field.csv\"\nlibrary = \"library.json\"\n[[camera]]\nid = \"cam1\"\n"
    "calibration = \"cam1.toml\"\n[forging]\ndiameter_mm = [150.0, 340.0]\n"
    "axis_direction = [2.0, 0.0, 0.0]\npolarity = \"dark\"\n";

struct RigFolder : TemporaryFolder {
  RigFolder() {
    write("library.json", kLibrary);
    write("field.csv", kField);
    write("cam1.toml", kCamera);
    write("rig.toml", kRig);
  }
  [[nodiscard]] std::string refusal() const {
    const auto rig = read_rig(*this / "rig.toml");
    if (rig) return "accepted";
    CHECK(rig.error().exit_status() == 2);
    return rig.error().message;
  }
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

}  // namespace

TEST_CASE("rig: all that it names is read, relative to the file") {
  RigFolder folder;
  const auto rig = read_rig(folder / "rig.toml");
  REQUIRE(rig);
  CHECK(rig->field.targets.at(7).p_world_mm == Eigen::Vector3d(100.5, -2.0, 30.0));
  CHECK(rig->library.codes[1].code == 0b01011U);
  CHECK(rig->find_camera("cam1")->focal_length_px == 500.0);
  CHECK(rig->find_camera("cam2") == nullptr);
  CHECK(rig->forging.axis_direction_world == Eigen::Vector3d::UnitX());
  CHECK(rig->forging.polarity == Polarity::dark);
  CHECK(rig->forging.end_section_mm == 80.0);
}

TEST_CASE("rig: every fault names its file and what is wrong there") {
  RigFolder folder;
  folder.write("field.csv", kField + "7,0,0,0\n");
  CHECK_THAT(folder.refusal(), Contains("field.csv:4") && Contains("id 7"));
  folder.write("field.csv", replaced(kField, "100.5", "wide"));
  CHECK_THAT(folder.refusal(), Contains("field.csv:3"));
  folder.write("field.csv", replaced(kField, "100.5", "nan"));
  CHECK_THAT(folder.refusal(), Contains("field.csv:3"));
  folder.write("field.csv", "");
  CHECK_THAT(folder.refusal(), Contains("field.csv"));
  folder.write("field.csv", kField);
  folder.write("library.json", replaced(kLibrary, "\"id\": 7", "\"id\": 1"));
  CHECK_THAT(folder.refusal(), Contains("library.json") && Contains("id 1"));
  folder.write("library.json", replaced(kLibrary, "01011", "0101"));
  CHECK_THAT(folder.refusal(), Contains("library.json") && Contains("5 digits"));
  folder.write("library.json", "{");
  CHECK_THAT(folder.refusal(), Contains("library.json"));
  folder.write("library.json", kLibrary);
  folder.write("cam1.toml", replaced(kCamera, "cam1", "cam9"));
  CHECK_THAT(folder.refusal(), Contains("cam9") && Contains("cam1"));
  folder.write("cam1.toml", kCamera);
  folder.write("rig.toml", replaced(kRig, "[150.0, 340.0]", "[340.0, 150.0]"));
  CHECK_THAT(folder.refusal(), Contains("rig.toml:7") && Contains("forging.diameter_mm"));
  folder.write("rig.toml", replaced(kRig, "\"dark\"", "\"grey\""));
  CHECK_THAT(folder.refusal(), Contains("forging.polarity"));
}

TEST_CASE("library and field: what was written is read back") {
  TemporaryFolder folder;
  TargetLibrary library{4, 2, {1.0, 1.8, 2.7}, {{3, 0b0001U}, {4, 0b0111U}}};
  REQUIRE(write_target_library(library, folder / "l.json"));
  const auto library_back = read_target_library(folder / "l.json");
  REQUIRE(library_back);
  CHECK(library_back->codes[1].code == 0b0111U);
  CHECK(library_back->geometry.ring_outer_radius == 2.7);
  TargetField field;
  field.targets[5] = {{1.25, -2.5, 3.0}, 0.05};
  REQUIRE(write_target_field(field, folder / "f.csv"));
  const auto field_back = read_target_field(folder / "f.csv");
  REQUIRE(field_back);
  CHECK(field_back->targets.at(5).p_world_mm == Eigen::Vector3d(1.25, -2.5, 3.0));
  CHECK(field_back->targets.at(5).sigma_mm == 0.05);
}

TEST_CASE("session: observations with their images, made absolute; faults named") {
  TemporaryFolder folder;
  const std::string good =
      "rig = \"rig.toml\"\n[[observation]]\nrotation_deg = 30.0\n[observation.images]\ncam1 = \"a.png\"\n";
  const auto session = read_session_file(folder.write("s.toml", good));
  REQUIRE(session);
  CHECK(session->observations.at(0).rotation_deg == 30.0);
  CHECK(session->observations.at(0).images.at("cam1") == std::filesystem::absolute(folder / "a.png"));
  CHECK_THAT(read_session_file(folder.write("s.toml", "rig = \"r\"\n")).error().message, Contains("[[observation]]"));
  CHECK_THAT(read_session_file(folder.write("s.toml", replaced(good, "\"a.png\"", "3"))).error().message,
             Contains("s.toml:5") && Contains("cam1"));
  CHECK_THAT(read_session_file(folder.write("s.toml", replaced(good, "30.0", "inf"))).error().message,
             Contains("s.toml:3"));
}

TEST_CASE("rig and session: a key nobody knows is a warning with its line, for it may be a mistyped one") {
  RigFolder folder;
  REQUIRE(read_rig(folder / "rig.toml")->warnings.empty());
  folder.write("rig.toml", replaced(kRig, "polarity", "polarityy"));
  const auto rig = read_rig(folder / "rig.toml");
  REQUIRE(rig);
  REQUIRE(rig->warnings.size() == 1);
  CHECK_THAT(rig->warnings[0], Contains("rig.toml:9: forging.polarityy: unknown key") && Contains("polarity"));
  folder.write("session.toml",
               "rig = \"rig.toml\"\nplace = 1\n[[observation]]\nrotation_degg = 60.0\nimages = { cam1 = \"a.png\" }\n");
  std::vector<std::string> warnings;
  REQUIRE(read_session_file(folder / "session.toml", warnings));
  REQUIRE(warnings.size() == 2);
  CHECK_THAT(warnings[0], Contains("session.toml:2: place: unknown key"));
  CHECK_THAT(warnings[1], Contains("session.toml:4: observation[0].rotation_degg: unknown key"));
}

TEST_CASE("session: one image for two cameras is refused") {
  RigFolder folder;
  folder.write("session.toml",
               "rig = \"rig.toml\"\n[[observation]]\nimages = { cam1 = \"a.png\", cam2 = \"a.png\" }\n");
  const auto session = read_session_file(folder / "session.toml");
  REQUIRE_FALSE(session);
  CHECK(session.error().exit_status() == 2);
  CHECK_THAT(session.error().message, Contains("images.cam2: expected an image of its own, found that of cam1"));
}
