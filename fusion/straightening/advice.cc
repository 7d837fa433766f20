#include "fusion/straightening/advice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

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
    constexpr std::size_t kApart = 5;  // sections between places that are tried
    const double half = 0.5 * config.support_span_mm;
    for (std::size_t i = 0; i < s_.size(); i += kApart) {
      if (s_[i] - half < config.end_margin_mm || s_[i] + half > length_mm_ - config.end_margin_mm) continue;
      places_.push_back({i, bent_at(i)});
    }
  }

  [[nodiscard]] const Axis& axis() const { return axis_; }

  static double largest(const Axis& axis) {
    double most = 0.0;
    for (const Eigen::Vector2d& point : axis) most = std::max(most, point.norm());
    return most;
  }

  /// As few strokes as bring the axis within tolerance, all their places and sizes chosen together: a stroke that
  /// leaves least by itself can leave a wave that no further one takes away. `axis()` is then the one they leave.
  std::vector<Stroke> strokes() {
    constexpr double kWorthwhile = 0.95;  // a further stroke leaves at most this share
    std::vector<std::size_t> at;
    Fit fit{{}, largest(axis_)};
    while (!places_.empty() && fit.left_mm > config_.tolerance_mm &&
           static_cast<int>(at.size()) < config_.most_strokes) {
      std::vector<std::size_t> more = at, spread;
      more.push_back(0);
      for (std::size_t j = 0; j < more.size(); ++j) spread.push_back((2 * j + 1) * places_.size() / (2 * more.size()));
      Fit better = place(more);
      if (const Fit evenly = place(spread); evenly.left_mm < better.left_mm) {
        better = evenly;
        more = spread;
      }
      if (!(better.left_mm < kWorthwhile * fit.left_mm)) break;
      at = std::move(more);
      fit = better;
    }
    return in_order(at, fit);
  }

 private:
  /// A place for the ram, and how the axis moves, seen from its new ideal axis, when it bends there by an angle of 1.
  struct Place {
    std::size_t section;
    std::vector<double> shape;
  };
  /// Angles of strokes at given places, and the largest deflection they leave.
  struct Fit {
    std::vector<Eigen::Vector2d> angles;
    double left_mm;
  };

  [[nodiscard]] std::vector<double> bent_at(std::size_t at) const {
    Axis axis;
    for (const double s : s_) axis.emplace_back(hinge(s, s_[at], diameter_[at]), 0.0);
    const IdealAxis line = ideal_axis(s_, axis, 0.0, length_mm_, end_section_mm_);
    std::vector<double> shape;
    for (std::size_t k = 0; k < s_.size(); ++k) shape.push_back(axis[k].x() - line.at(s_[k]).y());
    return shape;
  }

  [[nodiscard]] Axis after(std::span<const std::size_t> at, const Fit& fit) const {
    Axis axis = axis_;
    for (std::size_t j = 0; j < at.size(); ++j)
      for (std::size_t k = 0; k < axis.size(); ++k) axis[k] += places_[at[j]].shape[k] * fit.angles[j];
    return axis;
  }

  /// Moves the places in turn, the last one first (it may not be chosen yet), to where they leave least.
  Fit place(std::vector<std::size_t>& at) const {
    constexpr int kRounds = 3;
    Fit best{{}, largest(axis_)};
    for (int round = 0; round < kRounds; ++round)
      for (std::size_t j = at.size(); j-- > 0;) best = place_one(at, j);
    return best;
  }

  /// Of places that leave nearly the same, the one nearest to where the others leave most: there the bow is seen.
  Fit place_one(std::vector<std::size_t>& at, std::size_t j) const {
    const double alike_mm = 0.1 * config_.tolerance_mm;
    std::vector<std::size_t> others = at;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(j));
    const Axis rest = after(others, angles(others));
    const auto most = static_cast<std::size_t>(
        std::ranges::max_element(rest, {}, [](const Eigen::Vector2d& point) { return point.norm(); }) - rest.begin());
    std::vector<Fit> fits;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < places_.size(); ++i) {
      at[j] = i;
      fits.push_back(angles(at));
      least = std::min(least, fits.back().left_mm);
    }
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const double apart = std::abs(s_[places_[i].section] - s_[most]);
      if (fits[i].left_mm > least + alike_mm || apart >= nearest) continue;
      nearest = apart;
      at[j] = i;
    }
    return fits[at[j]];
  }

  /// The angles that leave the least largest deflection: least p-th powers with p doubled, as for the minimum zone.
  [[nodiscard]] Fit angles(std::span<const std::size_t> at) const {
    const auto n = static_cast<Eigen::Index>(at.size());
    Fit best{std::vector<Eigen::Vector2d>(at.size(), Eigen::Vector2d::Zero()), largest(axis_)};
    if (at.empty()) return best;
    Fit fit = best;
    std::vector<double> distance(axis_.size(), 1.0);
    for (double p = 2.0; p < 200.0; p *= 2.0) {
      for (int iteration = 0; iteration < (p > 2.0 ? 4 : 1); ++iteration) {
        const double most = *std::ranges::max_element(distance);
        if (!(most > 0.0)) return fit;
        Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
        Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n, 2);
        Eigen::VectorXd row(n);
        for (std::size_t k = 0; k < axis_.size(); ++k) {
          const double weight = std::pow(distance[k] / most, p - 2.0);
          for (Eigen::Index j = 0; j < n; ++j) row(j) = places_[at[static_cast<std::size_t>(j)]].shape[k];
          normal += weight * row * row.transpose();
          right -= weight * row * axis_[k].transpose();
        }
        normal.diagonal().array() += 1e-9 * normal.trace() + 1e-12;  // two strokes at one place
        const Eigen::MatrixXd solution = normal.ldlt().solve(right);
        for (Eigen::Index j = 0; j < n; ++j) {
          Eigen::Vector2d& angle = fit.angles[static_cast<std::size_t>(j)];
          angle += (solution.row(j).transpose() - angle) / (p - 1.0);
        }
        const Axis bent = after(at, fit);
        for (std::size_t k = 0; k < bent.size(); ++k) distance[k] = bent[k].norm();
        fit.left_mm = largest(bent);
        if (fit.left_mm < best.left_mm) best = fit;
      }
    }
    return best;
  }

  /// The strokes as they are made, each time the one that leaves least.
  std::vector<Stroke> in_order(std::vector<std::size_t> at, Fit fit) {
    std::vector<Stroke> strokes;
    while (!at.empty()) {
      double least = std::numeric_limits<double>::infinity();
      std::size_t next = 0;
      for (std::size_t j = 0; j < at.size(); ++j) {
        const double left = largest(after(std::span(&at[j], 1), {{fit.angles[j]}, 0.0}));
        if (left < least) least = left, next = j;
      }
      strokes.push_back(stroke(places_[at[next]].section, fit.angles[next], least));
      axis_ = after(std::span(&at[next], 1), {{fit.angles[next]}, 0.0});
      at.erase(at.begin() + static_cast<std::ptrdiff_t>(next));
      fit.angles.erase(fit.angles.begin() + static_cast<std::ptrdiff_t>(next));
    }
    return strokes;
  }

  [[nodiscard]] Stroke stroke(std::size_t section, const Eigen::Vector2d& angle, double left_mm) const {
    // An angle of the axis after the hinge pushes the hinge the other way, against the line of the supports.
    const Eigen::Vector2d push = -angle;
    const double half = 0.5 * config_.support_span_mm;
    const double direction = std::atan2(push.y(), push.x()) * 180.0 / M_PI;
    const double bend = 0.5 * half * push.norm();
    return {.at_mm = s_[section],
            .support_first_mm = s_[section] - half,
            .support_last_mm = s_[section] + half,
            .turn_deg = std::remainder(config_.press_direction_deg - direction, 360.0),
            .bend_mm = bend,
            .travel_mm = config_.springback * bend,
            .predicted_max_deflection_mm = left_mm};
  }

  StraighteningConfig config_;
  double end_section_mm_, length_mm_;
  std::vector<double> s_, diameter_;
  std::vector<Place> places_;
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
  advice.strokes = straightener.strokes();
  const double left = advice.strokes.empty() ? m.max_deflection_mm : advice.strokes.back().predicted_max_deflection_mm;
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
