#include "fusion/straightening/advice.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "fusion/combine/alignment.h"

namespace imprint {
namespace {

using Axis = std::vector<Eigen::Vector2d>;

/// What bends with a stroke at `at_mm` by an angle of 1: nothing before the hinge, a straight line after it, over the
/// hinge's length an arc.
double hinge(double s_mm, double at_mm, double length_mm) {
  const double into = s_mm - (at_mm - 0.5 * length_mm);
  if (into <= 0.0) return 0.0;
  if (into >= length_mm) return s_mm - at_mm;
  return 0.5 * into * into / length_mm;
}

class Straightener {
 public:
  Straightener(const Measurement& m, double end_section_mm, const StraighteningConfig& config)
      : config_(config), end_section_mm_(end_section_mm), length_mm_(m.length_mm) {
    for (const Measurement::Section& section : m.sections) {
      s_.push_back(section.s_mm);
      diameter_.push_back(section.diameter_mm);
      axis_.emplace_back(section.axis_mm[1], section.axis_mm[2]);
    }
  }

  [[nodiscard]] const Axis& axis() const { return axis_; }

  static double largest(const Axis& axis) {
    double most = 0.0;
    for (const Eigen::Vector2d& point : axis) most = std::max(most, point.norm());
    return most;
  }

  /// The stroke that leaves least; false when none leaves less than a twentieth less than there is.
  bool stroke(Stroke& best) {
    constexpr std::size_t kApart = 5;  // sections between places that are tried
    constexpr double kWorthwhile = 0.95;
    double least = kWorthwhile * largest(axis_);
    bool found = false;
    Axis bent;
    for (std::size_t i = 0; i < s_.size(); i += kApart) {
      const double half = 0.5 * config_.support_span_mm;
      if (s_[i] - half < config_.end_margin_mm || s_[i] + half > length_mm_ - config_.end_margin_mm) continue;
      const Axis shape = aligned(bend(Axis(axis_.size(), Eigen::Vector2d::Zero()), i, Eigen::Vector2d::UnitX()));
      const Eigen::Vector2d angle = best_angle(shape);
      Axis after = axis_;
      for (std::size_t k = 0; k < after.size(); ++k) after[k] += shape[k].x() * angle;
      const double left = largest(after);
      if (left >= least) continue;
      least = left;
      found = true;
      bent = std::move(after);
      // An angle of the axis after the hinge pushes the hinge the other way, against the line of the supports.
      const Eigen::Vector2d push = -angle;
      best.at_mm = s_[i];
      best.support_first_mm = s_[i] - half;
      best.support_last_mm = s_[i] + half;
      best.bend_mm = 0.5 * half * push.norm();
      best.travel_mm = config_.springback * best.bend_mm;
      const double direction = std::atan2(push.y(), push.x()) * 180.0 / M_PI;
      best.turn_deg = std::remainder(config_.press_direction_deg - direction, 360.0);
      best.predicted_max_deflection_mm = left;
    }
    if (found) axis_ = std::move(bent);
    return found;
  }

 private:
  [[nodiscard]] Axis bend(Axis axis, std::size_t at, const Eigen::Vector2d& angle) const {
    for (std::size_t k = 0; k < axis.size(); ++k) axis[k] += hinge(s_[k], s_[at], diameter_[at]) * angle;
    return axis;
  }
  [[nodiscard]] Axis aligned(Axis axis) const {
    const IdealAxis line = ideal_axis(s_, axis, 0.0, length_mm_, end_section_mm_);
    for (std::size_t k = 0; k < axis.size(); ++k) axis[k] -= line.at(s_[k]).tail<2>();
    return axis;
  }

  /// The angle that leaves the least largest deflection: least p-th powers with p doubled, as for the minimum zone.
  [[nodiscard]] Eigen::Vector2d best_angle(const Axis& shape) const {
    Eigen::Vector2d angle = Eigen::Vector2d::Zero(), best = angle;
    double least = largest(axis_);
    std::vector<double> distance(axis_.size(), 1.0);
    for (double p = 2.0; p < 200.0; p *= 2.0) {
      for (int iteration = 0; iteration < (p > 2.0 ? 4 : 1); ++iteration) {
        const double most = *std::ranges::max_element(distance);
        if (!(most > 0.0)) return angle;
        double normal = 1e-12;
        Eigen::Vector2d right = Eigen::Vector2d::Zero();
        for (std::size_t k = 0; k < axis_.size(); ++k) {
          const double weight = std::pow(distance[k] / most, p - 2.0);
          normal += weight * shape[k].x() * shape[k].x();
          right -= weight * shape[k].x() * axis_[k];
        }
        angle += (right / normal - angle) / (p - 1.0);
        double widest = 0.0;
        for (std::size_t k = 0; k < axis_.size(); ++k) {
          distance[k] = (axis_[k] + shape[k].x() * angle).norm();
          widest = std::max(widest, distance[k]);
        }
        if (widest < least) least = widest, best = angle;
      }
    }
    return best;
  }

  StraighteningConfig config_;
  double end_section_mm_, length_mm_;
  std::vector<double> s_, diameter_;
  Axis axis_;
};

}  // namespace

Result<void> StraighteningConfig::validate() const {
  if (!(tolerance_mm > 0.0)) return invalid_input("tolerance: more than 0 mm expected, found {}", tolerance_mm);
  if (!(support_span_mm > 0.0) || !(end_margin_mm >= 0.0))
    return invalid_input("supports: a span above 0 and a margin of 0 or more expected, found {} and {} mm",
                         support_span_mm, end_margin_mm);
  if (!(springback >= 1.0)) return invalid_input("springback: at least 1 expected, found {}", springback);
  if (most_strokes < 1) return invalid_input("strokes: at least 1 expected, found {}", most_strokes);
  if (!std::isfinite(press_direction_deg)) return invalid_input("press direction: an angle expected");
  return {};
}

Result<StraighteningAdvice> advise(const Measurement& m, double end_section_mm, const StraighteningConfig& config) {
  if (const auto valid = config.validate(); !valid) return pass_on(valid.error());
  if (m.sections.size() < 10) return job_failed("a result with {} sections cannot be straightened", m.sections.size());
  StraighteningAdvice advice;
  Straightener straightener(m, end_section_mm, config);
  advice.max_deflection = {m.max_deflection_mm, m.straightness.max_deflection.ci95_mm};
  advice.predicted_axis_mm = straightener.axis();
  if (m.max_deflection_mm <= config.tolerance_mm) {
    advice.reason = fmt::format("no action: {:.2f} mm are within the tolerance of {:.2f} mm", m.max_deflection_mm,
                                config.tolerance_mm);
    return advice;
  }
  if (config.support_span_mm + 2.0 * config.end_margin_mm > m.length_mm)
    return invalid_input("supports {:.0f} mm apart and {:.0f} mm from the ends do not fit under {:.0f} mm",
                         config.support_span_mm, config.end_margin_mm, m.length_mm);
  double left = m.max_deflection_mm;
  Stroke stroke;
  while (left > config.tolerance_mm && static_cast<int>(advice.strokes.size()) < config.most_strokes &&
         straightener.stroke(stroke)) {
    advice.strokes.push_back(stroke);
    left = stroke.predicted_max_deflection_mm;
  }
  advice.action = !advice.strokes.empty();
  advice.predicted_axis_mm = straightener.axis();
  advice.reason =
      !advice.action ? "no action: no stroke between these supports would make it straighter by a twentieth"
      : left <= config.tolerance_mm
          ? fmt::format("{} stroke(s) to within the tolerance of {:.2f} mm", advice.strokes.size(), config.tolerance_mm)
          : fmt::format("{} stroke(s), then measure again: {:.2f} mm would be left of the {:.2f} allowed",
                        advice.strokes.size(), left, config.tolerance_mm);
  return advice;
}

StrokeRecord record_of(const Measurement& before, const Measurement& after, const Stroke& stroke) {
  const double share = (stroke.at_mm - stroke.support_first_mm) / (stroke.support_last_mm - stroke.support_first_mm);
  const auto sag = [&](const Measurement& m) {
    const auto axis = [&](double s) {
      const Measurement::Section section = section_at(m, s);
      return Eigen::Vector2d(section.axis_mm[1], section.axis_mm[2]);
    };
    return Eigen::Vector2d(axis(stroke.at_mm) - (1.0 - share) * axis(stroke.support_first_mm) -
                           share * axis(stroke.support_last_mm));
  };
  // The two may have been measured at different turns: the sizes count, less where the bow was bent past straight.
  const double was = sag(before).norm(), is = sag(after).norm();
  const bool overbent = std::abs(was + is - stroke.bend_mm) < std::abs(was - is - stroke.bend_mm);
  return {stroke.travel_mm, overbent ? was + is : was - is};
}

Result<double> learn_springback(std::span<const StrokeRecord> records) {
  double products = 0.0, squares = 0.0;
  for (const StrokeRecord& record : records) {
    if (!(record.bend_mm > 0.0) || !(record.travel_mm > 0.0)) continue;
    products += record.travel_mm * record.bend_mm;
    squares += record.bend_mm * record.bend_mm;
  }
  if (!(squares > 0.0)) return job_failed("{} strokes, none of which has bent the forging", records.size());
  return std::max(1.0, products / squares);
}

nlohmann::json to_json(const StraighteningAdvice& advice) {
  nlohmann::json json = {{"schema", "imprint.straightening/1"},
                         {"action", advice.action},
                         {"reason", advice.reason},
                         {"max_deflection_mm", advice.max_deflection.mm},
                         {"max_deflection_ci95_mm", advice.max_deflection.ci95_mm},
                         {"strokes", nlohmann::json::array()},
                         {"predicted_axis_mm", nlohmann::json::array()}};
  for (const Stroke& stroke : advice.strokes)
    json["strokes"].push_back({{"at_mm", stroke.at_mm},
                               {"supports_mm", {stroke.support_first_mm, stroke.support_last_mm}},
                               {"turn_deg", stroke.turn_deg},
                               {"bend_mm", stroke.bend_mm},
                               {"travel_mm", stroke.travel_mm},
                               {"predicted_max_deflection_mm", stroke.predicted_max_deflection_mm}});
  for (const Eigen::Vector2d& point : advice.predicted_axis_mm)
    json["predicted_axis_mm"].push_back({point.x(), point.y()});
  return json;
}

}  // namespace imprint
