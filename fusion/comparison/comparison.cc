#include "fusion/comparison/comparison.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

using Points = std::vector<Eigen::Vector3d>;

void move(Points& points, const Placement& placement) {
  for (Eigen::Vector3d& point : points) point = placement.point(point);
}

/// Along the longest extent, from the middle.
Placement principal_frame(const Points& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  const Eigen::Vector3d longest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
  Placement placement;
  placement.R = forging_axes(longest);
  placement.shift_mm = -placement.R * mean;
  return placement;
}

/// Without what stands far off the axis, and without the last few points beyond either end.
void drop_strays(Points& points) {
  std::vector<double> distance;
  for (const Eigen::Vector3d& p : points) distance.push_back(p.tail<2>().norm());
  const double limit = 2.0 * median(distance);
  std::erase_if(points, [&](const Eigen::Vector3d& p) { return p.tail<2>().norm() > limit; });
}

std::vector<CloudSection> cut_all(const SortedCloud& cloud, const std::vector<double>& places, double slice_mm) {
  std::vector<CloudSection> sections;
  for (const double x : places)
    if (auto section = cloud.cut(x, slice_mm)) sections.push_back(*section);
  return sections;
}

std::vector<double> evenly(double first, double last, int count) {
  std::vector<double> places;
  for (int i = 0; i < count; ++i) places.push_back(first + (last - first) * (i + 0.5) / count);
  return places;
}

/// Where the cloud begins and ends along x: the thousandth point of a sorted cloud is no stray.
std::pair<double, double> extent(const Points& points) {
  std::vector<double> x;
  for (const Eigen::Vector3d& p : points) x.push_back(p.x());
  std::ranges::sort(x);
  const std::size_t skip = x.size() / 2000;
  return {x[skip], x[x.size() - 1 - skip]};
}

/// To the ideal axis through the cloud's own end sections, x from its first end.
Result<Placement> align(Points& points, const CompareConfig& config) {
  constexpr int kPlaces = 300;
  constexpr std::size_t kNeeded = 60;
  Placement whole;
  const auto take = [&](const Placement& step) {
    move(points, step);
    whole = {step.R * whole.R, step.R * whole.shift_mm + step.shift_mm};
  };
  if (!config.same_frame) take(principal_frame(points));
  drop_strays(points);
  if (points.size() < 1000) return job_failed("the cloud has {} points on a rod, at least 1000 needed", points.size());
  for (int iteration = 0; iteration < 3; ++iteration) {
    const auto [first, last] = extent(points);
    const auto sections = cut_all(SortedCloud(points), evenly(first, last, kPlaces), config.slice_mm);
    if (sections.size() < kNeeded)
      return job_failed(
          "the cloud has {} of {} cross-sections that can be measured, {} needed: is it a rod in mm, "
          "cropped to the forging, seen from two thirds of its circumference?",
          sections.size(), kPlaces, kNeeded);
    std::vector<double> x;
    std::vector<Eigen::Vector2d> yz;
    for (const CloudSection& section : sections) x.push_back(section.x_mm), yz.push_back(section.center_mm);
    const IdealAxis line = ideal_axis(x, yz, first, last, config.end_section_mm);
    Placement step;
    step.R = forging_axes(Eigen::Vector3d(1.0, line.slope.x(), line.slope.y()));
    step.shift_mm = -step.R * line.at(first);
    if (config.same_frame) step.shift_mm.x() = 0.0;
    take(step);
  }
  return whole;
}

/// How badly the diameters fit when the cloud is moved by `shift_mm`: median difference from their own median.
double misfit(const Measurement& m, const std::vector<CloudSection>& sections, double shift_mm) {
  std::vector<double> off;
  for (const CloudSection& section : sections) {
    const double x = section.x_mm + shift_mm;
    if (x < 0.0 || x > m.length_mm) continue;
    off.push_back(section_at(m, x).diameter_mm - section.diameter_mm);
  }
  if (off.size() < sections.size() / 2) return 1e9;
  const double middle = median(off);
  double sum = 0.0;
  for (const double value : off) sum += std::min(std::abs(value - middle), 10.0);
  return sum / static_cast<double>(off.size());
}

/// The turn about x that lays the cloud's axis on the result's; 0 for axes too straight to tell.
double turn_between(const Measurement& m, const std::vector<CloudSection>& sections) {
  double along = 0.0, across = 0.0;
  for (const CloudSection& section : sections) {
    const auto measured = section_at(m, section.x_mm);
    const Eigen::Vector2d a = section.center_mm, b(measured.axis_mm[1], measured.axis_mm[2]);
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  return std::atan2(across, along);
}

double axis_misfit(const Measurement& m, const std::vector<CloudSection>& sections, double turn) {
  double squares = 0.0;
  for (const CloudSection& section : sections) {
    const auto measured = section_at(m, section.x_mm);
    const Eigen::Vector2d turned = Eigen::Rotation2Dd(turn) * section.center_mm;
    squares += (turned - Eigen::Vector2d(measured.axis_mm[1], measured.axis_mm[2])).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(sections.size()));
}

struct Registration {
  bool reversed = false;
  double shift_mm = 0.0, turn_rad = 0.0;
  double cost = 1e18;
};

/// Of a cloud aligned by itself, which may lie either way round.
Registration register_cloud(const Measurement& m, const Points& points, const CompareConfig& config) {
  const auto [first, last] = extent(points);
  const auto sections = cut_all(SortedCloud(points), evenly(first, last, 300), config.slice_mm);
  Registration best;
  for (const bool reversed : {false, true}) {
    std::vector<CloudSection> laid = sections;
    if (reversed)
      for (CloudSection& section : laid) section.x_mm = last - section.x_mm, section.center_mm.y() *= -1.0;
    Registration one{.reversed = reversed};
    double least = 1e18;
    for (double shift = -config.max_shift_mm; shift <= config.max_shift_mm; shift += 0.5)
      if (const double cost = misfit(m, laid, shift); cost < least) least = cost, one.shift_mm = shift;
    for (CloudSection& section : laid) section.x_mm += one.shift_mm;
    one.turn_rad = turn_between(m, laid);
    one.cost = least + axis_misfit(m, laid, one.turn_rad);
    if (one.cost < best.cost) best = one;
  }
  return best;
}

Agreement agreement(const std::vector<double>& differences, const std::vector<char>& overlaps) {
  Agreement result;
  const auto n = static_cast<double>(differences.size());
  for (std::size_t i = 0; i < differences.size(); ++i) {
    result.mean_mm += differences[i] / n;
    result.rms_mm += differences[i] * differences[i] / n;
    result.overlap += overlaps[i] ? 1.0 / n : 0.0;
  }
  result.rms_mm = std::sqrt(result.rms_mm);
  result.median_mm = median(differences);
  return result;
}

void compare_sections(const Measurement& m, const SortedCloud& cloud, double slice_mm, Comparison& result) {
  std::vector<double> deflection, diameter, circularity;
  std::vector<char> axes_meet, diameters_meet, circularities_meet;
  for (const Measurement::Section& measured : m.sections) {
    const auto section = cloud.cut(measured.s_mm, slice_mm);
    if (!section) continue;
    const Eigen::Vector2d axis(measured.axis_mm[1], measured.axis_mm[2]);
    deflection.push_back(measured.deflection_mm - section->center_mm.norm());
    diameter.push_back(measured.diameter_mm - section->diameter_mm);
    circularity.push_back(measured.circularity_mm - section->circularity_mm);
    axes_meet.push_back((axis - section->center_mm).norm() <= measured.axis_ci95_mm + section->axis_ci95_mm);
    diameters_meet.push_back(std::abs(diameter.back()) <= measured.diameter_ci95_mm + section->diameter_ci95_mm);
    circularities_meet.push_back(std::abs(circularity.back()) <=
                                 measured.circularity_ci95_mm + section->circularity_ci95_mm);
    result.cloud.push_back(*section);
    result.measured.push_back(measured);
  }
  result.sections = static_cast<int>(result.cloud.size());
  result.of_sections = static_cast<int>(m.sections.size());
  if (result.cloud.empty()) return;
  result.axis = agreement(deflection, axes_meet);
  result.diameter = agreement(diameter, diameters_meet);
  result.circularity = agreement(circularity, circularities_meet);
}

}  // namespace

Result<void> CompareConfig::validate() const {
  if (!(end_section_mm > 0.0) || !(slice_mm > 0.0) || !(max_shift_mm >= 0.0))
    return invalid_input("compare: end section and slice above 0 expected, shift of 0 or more");
  return {};
}

Result<Comparison> compare(const Measurement& m, Points points, const CompareConfig& config) {
  if (const auto valid = config.validate(); !valid) return pass_on(valid.error());
  if (m.sections.size() < 10) return job_failed("the result has {} sections, at least 10 needed", m.sections.size());
  if (points.size() < 1000) return job_failed("the cloud has {} points, at least 1000 needed", points.size());
  Comparison result;
  if (config.same_frame) move(points, {m.R_forging_world, -m.R_forging_world * m.origin_world_mm});
  if (const auto aligned = align(points, config); !aligned) return pass_on(aligned.error());
  if (!config.same_frame) {
    const Registration found = register_cloud(m, points, config);
    const auto [first, last] = extent(points);
    Placement place;
    if (found.reversed) {
      place.R = Eigen::Vector3d(-1.0, 1.0, -1.0).asDiagonal();
      place.shift_mm.x() = last;
    }
    place.shift_mm.x() += found.shift_mm;
    const Eigen::Matrix3d turn = turn_about_x(found.turn_rad);
    move(points, {turn * place.R, turn * place.shift_mm});
    result.turn_deg = found.turn_rad * 180.0 / M_PI;
    result.shift_mm = found.shift_mm;
    result.reversed = found.reversed;
  }
  compare_sections(m, SortedCloud(std::move(points)), config.slice_mm, result);
  if (2 * result.sections < result.of_sections)
    return job_failed("the cloud covers {} of the result's {} sections: is it the same forging, whole?",
                      result.sections, result.of_sections);
  return result;
}

nlohmann::json to_json(const Comparison& c) {
  const auto column = [](const Agreement& a) {
    return nlohmann::json{
        {"overlap", a.overlap}, {"mean_mm", a.mean_mm}, {"median_mm", a.median_mm}, {"rms_mm", a.rms_mm}};
  };
  nlohmann::json json = {
      {"schema", "imprint.comparison/1"},
      {"axis", column(c.axis)},
      {"diameter", column(c.diameter)},
      {"circularity", column(c.circularity)},
      {"sections_compared", c.sections},
      {"sections_of_result", c.of_sections},
      {"registration", {{"turn_deg", c.turn_deg}, {"shift_mm", c.shift_mm}, {"reversed", c.reversed}}},
      {"sections", nlohmann::json::array()}};
  for (const CloudSection& section : c.cloud)
    json["sections"].push_back({{"s_mm", section.x_mm},
                                {"axis_mm", {section.x_mm, section.center_mm.x(), section.center_mm.y()}},
                                {"diameter_mm", section.diameter_mm},
                                {"circularity_mm", section.circularity_mm},
                                {"axis_ci95_mm", section.axis_ci95_mm},
                                {"diameter_ci95_mm", section.diameter_ci95_mm},
                                {"circularity_ci95_mm", section.circularity_ci95_mm},
                                {"points", section.points}});
  return json;
}

}  // namespace imprint
