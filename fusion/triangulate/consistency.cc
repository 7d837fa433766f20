#include "fusion/triangulate/consistency.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "fusion/triangulate/faceted_rod.h"
#include "fusion/triangulate/first_axis.h"
#include "fusion/triangulate/rim_tangents.h"

namespace imprint {
namespace {

constexpr int kThirds = 3;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Where most values lie close together: the middle of those within `width` of each other. Right as long as the right
/// ones agree, be they the smaller part.
double mode(std::vector<double>& values, double width) {
  if (values.size() < 3) return kNan;
  std::sort(values.begin(), values.end());
  std::size_t best = 0;
  std::size_t most = 0;
  std::size_t end = 0;
  for (std::size_t first = 0; first < values.size(); ++first) {
    while (end < values.size() && values[end] - values[first] <= width) ++end;
    if (end - first <= most) continue;
    most = end - first;
    best = first;
  }
  return values[best + most / 2];
}

/// What one camera says of the bar about a common axis, in each third of its length.
struct Testimony {
  std::array<double, kThirds> half_width_mm{};    ///< less the radius of the rod all agree on
  std::array<double, kThirds> across_mm{};        ///< place of the axis along `across`
  std::array<Eigen::Vector2d, kThirds> across{};  ///< direction in y, z
  std::optional<double> first_mm, last_mm;        ///< ends along the axis
};

Testimony testimony(const CameraView& view, const RodConsensus& rod) {
  Testimony said;
  const AxisCurve& axis = rod.axis;
  const std::vector<RimTangent> tangents = rim_tangents(std::span(&view, 1), axis);
  const double length = axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
  for (int third = 0; third < kThirds; ++third) {
    std::vector<double> upper, lower;
    Eigen::Vector2d normal = Eigen::Vector2d::Zero();
    for (const RimTangent& tangent : tangents) {
      const double share = (tangent.contact.x_mm - axis.x_first_mm) / length * kThirds;
      if (share < third || share >= third + 1) continue;
      (tangent.upper ? upper : lower).push_back(rod.deviation_mm(tangent.contact));
      const Eigen::Vector2d n = (axis.R_line * tangent.contact.normal).tail<2>();
      normal += tangent.upper ? n : Eigen::Vector2d(-n);
    }
    const auto k = static_cast<std::size_t>(third);
    const double above = mode(upper, rod.tolerance_mm());
    const double below = mode(lower, rod.tolerance_mm());
    said.half_width_mm[k] = 0.5 * (above + below);
    said.across_mm[k] = 0.5 * (above - below);
    said.across[k] = normal.normalized();
  }
  const bool along = runs_along(view, axis);
  said.first_mm = end_position(view, along ? view.start : view.end, axis, rod.radius_mm.front(), false);
  said.last_mm = end_position(view, along ? view.end : view.start, axis, rod.radius_mm.back(), true);
  return said;
}

/// An oval shows widths this many times further apart than a camera in the wrong place shows its axis.
constexpr double kOvalAllowance = 0.4;

/// The middle one of the thirds: scale or a beam may spoil one third of a camera, a wrong pose spoils two or all.
double middle(std::array<double, kThirds> misfits) {
  std::sort(misfits.begin(), misfits.end());
  return misfits[kThirds / 2];
}

/// How far the widths seen by different cameras lie apart, allowing for an oval.
double width_misfit(std::span<const Testimony> all) {
  std::array<double, kThirds> apart{};
  for (std::size_t t = 0; t < kThirds; ++t) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (const Testimony& said : all) {
      if (std::isnan(said.half_width_mm[t])) continue;
      low = std::min(low, said.half_width_mm[t]);
      high = std::max(high, said.half_width_mm[t]);
    }
    if (high > low) apart[t] = kOvalAllowance * 2.0 * (high - low);
  }
  return middle(apart);
}

/// How far one camera must be wrong about the axis' place at least, or 0 with fewer than three.
double place_misfit(std::span<const Testimony> all) {
  std::array<double, kThirds> wrong{};
  for (std::size_t t = 0; t < kThirds; ++t) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    std::vector<const Testimony*> present;
    for (const Testimony& said : all) {
      if (std::isnan(said.across_mm[t])) continue;
      normal += said.across[t] * said.across[t].transpose();
      right += said.across[t] * said.across_mm[t];
      present.push_back(&said);
    }
    if (present.size() < 3 || normal.determinant() < 1e-4) continue;
    const Eigen::Matrix2d inverse = normal.inverse();
    const Eigen::Vector2d place = inverse * right;
    double least = std::numeric_limits<double>::infinity();
    double most = 0.0;
    for (const Testimony* said : present) {
      const double redundancy = 1.0 - said->across[t].dot(inverse * said->across[t]);
      const double residual = std::abs(said->across_mm[t] - said->across[t].dot(place));
      if (redundancy < 0.02) continue;
      least = std::min(least, residual / redundancy);
      most = std::max(most, residual);
    }
    // Three lines that do not meet: any one may be wrong, so count the smallest fault that explains it.
    if (std::isfinite(least)) wrong[t] = present.size() == 3 ? least : most;
  }
  return middle(wrong);
}

double end_misfit(std::span<const Testimony> all) {
  double widest = 0.0;
  for (const bool last : {false, true}) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (const Testimony& said : all) {
      const auto& position = last ? said.last_mm : said.first_mm;
      if (!position) continue;
      low = std::min(low, *position);
      high = std::max(high, *position);
    }
    if (high > low) widest = std::max(widest, high - low);
  }
  return widest;
}

/// `axis` over exactly the stretch on which the rims touch.
AxisCurve over_rims(const AxisCurve& axis, std::span<const RimTangent> tangents) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const RimTangent& tangent : tangents) {
    low = std::min(low, tangent.contact.x_mm);
    high = std::max(high, tangent.contact.x_mm);
  }
  return over(axis, low, high);
}

/// A set of cameras, the axis they see and how well they agree.
struct Agreement {
  std::vector<CameraView> views;
  RodConsensus rod;
  double contradiction_mm = std::numeric_limits<double>::infinity();  ///< of widths and places
  double misfit_mm = std::numeric_limits<double>::infinity();         ///< of widths, places and ends
};

Result<Agreement> agreement_of(std::vector<CameraView> views, const ForgingSpec& forging,
                               const TriangulateConfig& config) {
  const double limit = config.max_ray_distance_share * forging.diameter_max_mm;
  const std::vector<Eigen::Vector3d> points = triangulate_axis_points(views, limit);
  auto line = line_through(points, forging.axis_direction_world, config.sections);
  if (!line) return pass_on(line.error());
  Agreement agreement{.views = std::move(views), .rod = {}};
  AxisCurve first = over_rims(*line, rim_tangents(agreement.views, *line));
  agreement.rod = config.faceted() ? faceted_rod(agreement.views, std::move(first))
                                   : agree_on_rod(agreement.views, std::move(first), forging);
  std::vector<Testimony> all;
  for (const CameraView& view : agreement.views) all.push_back(testimony(view, agreement.rod));
  // The widths of a faceted forging say nothing of a camera.
  agreement.contradiction_mm = std::max(config.faceted() ? 0.0 : width_misfit(all), place_misfit(all));
  agreement.misfit_mm = std::max(agreement.contradiction_mm, end_misfit(all));
  return agreement;
}

/// The widest angle between two cameras as seen from the axis, folded to 0..90 degrees: a camera on the opposite side
/// sees the same rims.
double widest_angle_deg(std::span<const CameraView> views, const AxisCurve& axis) {
  const AxisCurve::Place middle =
      axis.at(axis.x_first_mm + 0.5 * axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1));
  double widest = 0.0;
  const auto side = [&](const CameraView& view) {
    const Eigen::Vector3d d = view.pose.center_world_mm - middle.point_mm;
    return Eigen::Vector3d(d - d.dot(middle.direction) * middle.direction).normalized();
  };
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t j = i + 1; j < views.size(); ++j)
      widest = std::max(widest, std::acos(std::clamp(std::abs(side(views[i]).dot(side(views[j]))), 0.0, 1.0)));
  return widest * 180.0 / M_PI;
}

std::string names(std::span<const CameraView> views, std::span<const std::string> ids) {
  std::string list;
  for (const CameraView& view : views) {
    if (!list.empty()) list += ", ";
    list += ids[static_cast<std::size_t>(view.camera)];
  }
  return list;
}

}  // namespace

bool runs_along(const CameraView& view, const AxisCurve& axis) {
  const CurveRay* first = nullptr;
  const CurveRay* last = nullptr;
  for (const std::vector<CurveRay>* curve : {&view.upper, &view.lower}) {
    first = last = nullptr;
    for (const CurveRay& ray : *curve) {
      if (ray.weight <= 0.0) continue;
      if (first == nullptr) first = &ray;
      last = &ray;
    }
    if (first != nullptr) break;
  }
  if (first == nullptr) return true;
  return (last->direction_world - first->direction_world).dot(axis.R_line.row(0)) > 0.0;
}

std::optional<double> end_position(const CameraView& view, const EndRay& end, const AxisCurve& axis, double radius_mm,
                                   bool last, Eigen::Vector3d* circle_point_mm) {
  if (!end.visible) return std::nullopt;
  const double length = axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
  const double guess = axis.x_first_mm + (last ? length : 0.0);
  const auto point = meet_end_circle(axis, view.pose.center_world_mm, end.direction_world, radius_mm, last, guess);
  if (!point) return std::nullopt;
  const double x = axis.x_of(*point);
  // A reading outside twice the axis' own length belongs to something else.
  if (!(x > axis.x_first_mm - length && x < axis.x_first_mm + 2.0 * length)) return std::nullopt;
  if (circle_point_mm != nullptr) *circle_point_mm = *point;
  return x;
}

Result<AgreeingViews> agreeing_views(std::vector<CameraView> views, std::span<const std::string> ids,
                                     const ForgingSpec& forging, const TriangulateConfig& config) {
  AgreeingViews result;
  if (views.size() < 2) return job_failed("{} of {} cameras can be used, at least 2 needed", views.size(), ids.size());
  const double limit = config.max_disagreement_share * forging.diameter_max_mm;
  Result<Agreement> best = agreement_of(views, forging, config);
  while (views.size() > 2 && (!best || best->contradiction_mm > limit)) {
    // One camera left out at a time: the set that then agrees names the one that did not.
    std::vector<std::pair<Agreement, int>> trials;
    for (std::size_t drop = 0; drop < views.size(); ++drop) {
      std::vector<CameraView> others = views;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(drop));
      auto trial = agreement_of(std::move(others), forging, config);
      if (!trial || widest_angle_deg(trial->views, trial->rod.axis) < config.min_view_angle_deg) continue;
      trials.emplace_back(std::move(*trial), views[drop].camera);
    }
    if (trials.empty()) break;
    std::sort(trials.begin(), trials.end(),
              [](const auto& a, const auto& b) { return a.first.misfit_mm < b.first.misfit_mm; });
    const Agreement& agreed = trials.front().first;
    const double next = trials.size() > 1 ? trials[1].first.misfit_mm : std::numeric_limits<double>::infinity();
    // The others must agree well, and better than any other set by more than the noise of edges and ends.
    if (best && !(agreed.misfit_mm < limit && agreed.misfit_mm < 0.5 * next && next > 0.25 * limit)) {
      result.disagreement_mm = best->contradiction_mm;
      break;
    }
    const std::string by = best ? fmt::format(" by {:.1f} mm (limit {:.1f} mm)", best->contradiction_mm, limit) : "";
    result.excluded.emplace_back(
        trials.front().second,
        fmt::format("it contradicts {}{}; check its pose and its imprint", names(agreed.views, ids), by));
    best = agreed;
    views = best->views;
  }
  if (!best) return pass_on(best.error());
  if (best->views.size() == 2 && best->contradiction_mm > limit) result.disagreement_mm = best->contradiction_mm;
  const double angle = widest_angle_deg(best->views, best->rod.axis);
  if (angle < config.min_view_angle_deg)
    return job_failed(
        "cameras {} look in nearly the same direction: {:.1f} deg apart as seen from the forging, at least {:.0f} deg "
        "needed",
        names(best->views, ids), angle, config.min_view_angle_deg);
  result.views = std::move(best->views);
  result.rod = std::move(best->rod);
  return result;
}

}  // namespace imprint
