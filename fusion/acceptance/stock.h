#pragma once

#include <span>

#include <Eigen/Core>

#include "fusion/combine/section_shape.h"

namespace imprint {

/// One section of the forging and the radius of the part that has to lie in it.
struct StockSection {
  double s_mm = 0.0;
  const SectionShape* shape = nullptr;
  double part_radius_mm = 0.0;
};

/// A straight axis across the forging: (y, z) = middle + slope (s - s_middle_mm).
struct PartAxis {
  double s_middle_mm = 0.0;
  Eigen::Vector2d middle_mm = Eigen::Vector2d::Zero(), slope = Eigen::Vector2d::Zero();
  [[nodiscard]] Eigen::Vector2d at(double s_mm) const { return middle_mm + slope * (s_mm - s_middle_mm); }
};

struct LeastStock {
  double mm = 0.0;
  double s_mm = 0.0;
  double direction_rad = 0.0;
};

/// Where the part on that axis has least material over it: of all sections and directions, the distance of the
/// section's tangent from the part's circle.
LeastStock least_stock(std::span<const StockSection> sections, const PartAxis& axis);

/// The axis on which the least stock is largest, to 0.01 mm. `sections` are not empty.
PartAxis best_part_axis(std::span<const StockSection> sections);

}  // namespace imprint
