#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "lib/camera/camera_model.h"
#include "lib/camera/dot_disc.h"
#include "lib/result/result.h"
#include "lib/targets/target_field.h"
#include "lib/targets/target_library.h"

namespace imprint {

enum class Polarity { bright, dark };

/// Shape of a forging's sections. `unknown`: told by how its widths change from one observation to the next.
enum class SectionKind { unknown, round, square, rectangle, octagon, convex };
inline constexpr std::array<std::string_view, 6> kSectionKinds{"auto",      "round",   "square",
                                                               "rectangle", "octagon", "convex"};
constexpr std::string_view name_of(SectionKind kind) { return kSectionKinds[static_cast<std::size_t>(kind)]; }

/// What the cameras of one line look at.
struct ForgingSpec {
  double diameter_min_mm = 0.0;
  double diameter_max_mm = 0.0;
  Eigen::Vector3d axis_direction_world = Eigen::Vector3d::UnitX();  ///< rough; length 1
  double end_section_mm = 80.0;  ///< length of the two end sections that define the ideal axis
  Polarity polarity = Polarity::bright;
  SectionKind section = SectionKind::unknown;
};

/// `rig.toml` with all that it names, read.
struct Rig {
  TargetField field;
  DotDiscs dots;  ///< of the field's targets, where `rig.toml` names a file of them
  TargetLibrary library;
  std::vector<CameraModel> cameras;  ///< in the file's order; ids unique
  ForgingSpec forging;
  std::vector<std::string> warnings;  ///< of files that could be read, but not exactly

  [[nodiscard]] const CameraModel* find_camera(std::string_view id) const;
};

Result<Rig> read_rig(const std::filesystem::path& path);

struct SessionObservation {
  double rotation_deg = 0.0;  ///< about the forging axis, right-handed about the rig's axis_direction
  std::map<std::string, std::filesystem::path> images;  ///< by camera id, absolute
};

/// `session.toml`: one forging, one or more observations.
struct SessionFile {
  std::filesystem::path rig;
  std::vector<SessionObservation> observations;
};

Result<SessionFile> read_session_file(const std::filesystem::path& path);

}  // namespace imprint
