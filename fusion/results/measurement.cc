#include "fusion/results/measurement.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <future>

#include <Eigen/Eigenvalues>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr double kCi95 = 1.959964;  // standard deviations of a normal value

/// Radius of the circle about the measured axis point that holds the true one with 95 %. Between a line (1.960 sigma)
/// and a round cloud (2.448 sigma) the fit is good to 0.5 %.
double axis_ci95_mm(const Eigen::Matrix2d& covariance) {
  const Eigen::Vector2d variances =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance, Eigen::EigenvaluesOnly).eigenvalues();
  const double larger = std::sqrt(std::max(variances(1), 0.0));
  const double smaller = std::sqrt(std::max(variances(0), 0.0));
  if (!(larger > 0.0)) return 0.0;
  return larger * (kCi95 + 0.4878 * std::pow(smaller / larger, 2.7));
}

}  // namespace

Measurement make_measurement(const CombinedForging& forging, std::vector<Measurement::Observation> observations,
                             std::string session, std::string method) {
  Measurement measurement;
  measurement.session = std::move(session);
  measurement.method = std::move(method);
  measurement.length_mm = forging.length_mm;
  measurement.length_ci95_mm = kCi95 * forging.length_sigma_mm;
  measurement.R_forging_world = forging.R_forging_world;
  measurement.origin_world_mm = forging.origin_world_mm;
  measurement.observations = std::move(observations);
  measurement.warnings = forging.warnings;
  auto roundness = std::async(std::launch::async, evaluate_roundness, std::cref(forging));  // half of the work
  measurement.straightness = evaluate_straightness(forging);
  measurement.diameters = evaluate_diameters(forging);
  measurement.roundness = roundness.get();
  measurement.section_kind = forging.section_kind;
  measurement.facets = forging.facets;
  measurement.shape = forging.shape;
  measurement.draws = forging.draws;
  measurement.max_deflection_mm = measurement.straightness.max_deflection.mm;
  measurement.max_deflection_at_mm = measurement.straightness.max_deflection_at_mm;
  measurement.max_deflection_direction_deg = measurement.straightness.max_deflection_direction_deg;
  for (const CombinedSection& from : forging.sections) {
    Measurement::Section section{};
    section.s_mm = from.s_mm;
    for (int i = 0; i < 3; ++i) section.axis_mm[i] = from.axis_mm(i);
    section.deflection_mm = std::hypot(from.axis_mm.y(), from.axis_mm.z());
    section.diameter_mm = from.diameter_mm;
    section.circularity_mm = from.circularity_mm;
    section.axis_ci95_mm = axis_ci95_mm(from.axis_covariance_mm2);
    section.diameter_ci95_mm = kCi95 * from.diameter_sigma_mm;
    section.circularity_ci95_mm = kCi95 * from.circularity_sigma_mm;
    measurement.sections.push_back(section);
  }
  return measurement;
}

Measurement::Sureness sureness(const CombinedForging& forging) {
  std::vector<double> axis, diameter, circularity;
  for (const CombinedSection& section : forging.sections) {
    axis.push_back(axis_ci95_mm(section.axis_covariance_mm2));
    diameter.push_back(kCi95 * section.diameter_sigma_mm);
    circularity.push_back(kCi95 * section.circularity_sigma_mm);
  }
  return {median(std::move(axis)), median(std::move(diameter)), median(std::move(circularity))};
}

Measurement::Section section_at(const Measurement& measurement, double s_mm) {
  const auto& sections = measurement.sections;
  const auto after = std::ranges::lower_bound(sections, s_mm, {}, &Measurement::Section::s_mm);
  if (after == sections.begin()) return sections.front();
  if (after == sections.end()) return sections.back();
  const Measurement::Section &a = *(after - 1), &b = *after;
  const double u = (s_mm - a.s_mm) / (b.s_mm - a.s_mm);
  Measurement::Section between = u < 0.5 ? a : b;
  const auto mix = [u](double x, double y) { return (1.0 - u) * x + u * y; };
  between.s_mm = s_mm;
  for (int i = 0; i < 3; ++i) between.axis_mm[i] = mix(a.axis_mm[i], b.axis_mm[i]);
  between.deflection_mm = std::hypot(between.axis_mm[1], between.axis_mm[2]);
  between.diameter_mm = mix(a.diameter_mm, b.diameter_mm);
  between.circularity_mm = mix(a.circularity_mm, b.circularity_mm);
  between.axis_ci95_mm = std::max(a.axis_ci95_mm, b.axis_ci95_mm);
  between.diameter_ci95_mm = std::max(a.diameter_ci95_mm, b.diameter_ci95_mm);
  between.circularity_ci95_mm = std::max(a.circularity_ci95_mm, b.circularity_ci95_mm);
  return between;
}

}  // namespace imprint
