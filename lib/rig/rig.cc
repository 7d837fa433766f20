#include "lib/rig/rig.h"

#include <algorithm>

#include <fmt/ranges.h>

#include "lib/camera/camera_file.h"
#include "lib/config/toml_file.h"
#include "lib/config/unknown_keys.h"

namespace imprint {
namespace {

ForgingSpec read_forging(TomlReader& read) {
  ForgingSpec forging;
  const auto diameters = read.numbers("forging.diameter_mm", 2);
  forging.diameter_min_mm = diameters[0];
  forging.diameter_max_mm = diameters[1];
  if (!(diameters[0] > 0 && diameters[1] >= diameters[0])) {
    read.fault("forging.diameter_mm",
               fmt::format("expected [smallest, largest] with 0 < smallest <= largest, found [{}, {}]", diameters[0],
                           diameters[1]));
  }
  const auto direction = read.numbers("forging.axis_direction", 3, std::vector<double>{1.0, 0.0, 0.0});
  forging.axis_direction_world = Eigen::Vector3d(direction[0], direction[1], direction[2]);
  if (forging.axis_direction_world.norm() < 1e-9) {
    read.fault("forging.axis_direction", "expected a direction in the world frame, found a vector of length 0");
  }
  forging.axis_direction_world.normalize();
  forging.end_section_mm = read.number("forging.end_section_mm", forging.end_section_mm);
  if (!(forging.end_section_mm > 0)) {
    read.fault("forging.end_section_mm", fmt::format("expected a positive length, found {}", forging.end_section_mm));
  }
  const auto polarity = read.string("forging.polarity", "bright");
  forging.polarity = polarity == "dark" ? Polarity::dark : Polarity::bright;
  if (polarity != "bright" && polarity != "dark") {
    read.fault("forging.polarity", fmt::format("expected \"bright\" or \"dark\", found \"{}\"", polarity));
  }
  const auto section = read.string("forging.section", std::string(name_of(SectionKind::unknown)));
  const auto known = std::find(kSectionKinds.begin(), kSectionKinds.end(), section);
  if (known == kSectionKinds.end()) {
    read.fault("forging.section",
               fmt::format("expected one of {}, found \"{}\"", fmt::join(kSectionKinds, ", "), section));
  } else {
    forging.section = static_cast<SectionKind>(known - kSectionKinds.begin());
  }
  return forging;
}

Result<std::vector<CameraModel>> read_cameras(const std::filesystem::path& path, TomlReader& read,
                                              std::vector<std::string>& warnings) {
  std::vector<CameraModel> cameras;
  int number = 0;
  for (const toml::table* entry : read.tables("camera")) {
    TomlReader read_entry(path, *entry, fmt::format("camera[{}].", number++));
    const auto id = read_entry.string("id");
    note_unknown_keys(path, *entry, fmt::format("camera[{}].", number - 1), {"id", "calibration"}, warnings);
    const auto file = read_entry.path("calibration");
    if (read_entry.error()) return pass_on(*read_entry.error());
    auto camera = read_camera_file(file, &warnings);
    if (!camera) return pass_on(camera.error());
    if (camera->id != id) {
      return invalid_input("{}: camera \"{}\" names the calibration {}, which is of camera \"{}\"", path.string(), id,
                           file.string(), camera->id);
    }
    if (std::any_of(cameras.begin(), cameras.end(), [&](const CameraModel& other) { return other.id == id; })) {
      return invalid_input("{}: camera \"{}\" stands there twice", path.string(), id);
    }
    cameras.push_back(std::move(*camera));
  }
  if (cameras.empty() && !read.error()) {
    return invalid_input("{}: expected at least one [[camera]], found none", path.string());
  }
  return cameras;
}

}  // namespace

const CameraModel* Rig::find_camera(std::string_view id) const {
  const auto found =
      std::find_if(cameras.begin(), cameras.end(), [&](const CameraModel& camera) { return camera.id == id; });
  return found == cameras.end() ? nullptr : &*found;
}

Result<Rig> read_rig(const std::filesystem::path& path) {
  const auto table = parse_toml_file(path);
  if (!table) return pass_on(table.error());
  TomlReader read(path, *table);
  const auto field_path = read.path("field");
  const auto library_path = read.path("library");
  const auto dots_path = read.path("dots", std::filesystem::path{});
  Rig rig;
  rig.forging = read_forging(read);
  auto cameras = read_cameras(path, read, rig.warnings);
  note_unknown_keys(path, *table, "", {"field", "library", "camera", "forging"}, rig.warnings);
  if (const toml::table* forging = (*table)["forging"].as_table()) {
    note_unknown_keys(path, *forging, "forging.",
                      {"diameter_mm", "axis_direction", "end_section_mm", "polarity", "section"}, rig.warnings);
  }
  if (read.error()) return pass_on(*read.error());
  if (!cameras) return pass_on(cameras.error());
  rig.cameras = std::move(*cameras);
  auto field = read_target_field(field_path);
  if (!field) return pass_on(field.error());
  rig.field = std::move(*field);
  if (!dots_path.empty()) {
    auto dots = read_dot_discs(dots_path);
    if (!dots) return pass_on(dots.error());
    rig.dots = std::move(*dots);
  }
  auto library = read_target_library(library_path);
  if (!library) return pass_on(library.error());
  rig.library = std::move(*library);
  return rig;
}

}  // namespace imprint
