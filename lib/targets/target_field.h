#pragma once

#include <filesystem>
#include <map>
#include <optional>

#include <Eigen/Core>

#include "lib/result/result.h"

namespace imprint {

struct FieldTarget {
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
  std::optional<double> sigma_mm;  ///< of each coordinate, where the field states it
};

/// Target centres in the world by id; `field.csv` of the contract.
struct TargetField {
  std::map<int, FieldTarget> targets;
};

/// Reads `field.csv`. Names the line of a repeated id, a missing column or a value that is no finite number.
Result<TargetField> read_target_field(const std::filesystem::path& path);

Result<void> write_target_field(const TargetField& field, const std::filesystem::path& path);

}  // namespace imprint
