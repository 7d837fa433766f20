#include "fusion/triangulate/rim_tangents.h"

namespace imprint {

std::vector<RimTangent> rim_tangents(std::span<const CameraView> views, const AxisCurve& axis) {
  std::vector<RimTangent> tangents;
  tangents.reserve(views.size() * 2 * kImprintStations);
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (const bool upper : {true, false}) {
      double x_guess = axis.x_first_mm + 0.5 * axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
      for (const CurveRay& ray : upper ? views[v].upper : views[v].lower) {
        if (ray.weight <= 0.0) continue;
        const auto contact = touch(axis, views[v].pose.center_world_mm, ray.direction_world, x_guess);
        if (!contact) continue;
        x_guess = contact->x_mm;
        tangents.push_back({.view = v,
                            .upper = upper,
                            .ray = ray.direction_world,
                            .weight = ray.weight,
                            .mm_per_px = contact->range_mm / views[v].focal_length_px,
                            .contact = *contact});
      }
    }
  }
  return tangents;
}

}  // namespace imprint
