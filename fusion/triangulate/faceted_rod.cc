#include "fusion/triangulate/faceted_rod.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Dense>

namespace imprint {
namespace {

constexpr double kScatterShare = 0.1;  // of the radius: what rims lie off the mean radius, corners and faces

/// What one camera sees of one section: half its width, and how far the middle of its rims lies from the axis towards
/// the upper one.
struct Middle {
  std::size_t sample, view;
  Eigen::Vector2d towards;
  double beside_mm, half_width_mm;
};

std::vector<Middle> middles(std::span<const CameraView> views, const AxisCurve& axis) {
  struct Rims {
    double sum[2] = {0.0, 0.0}, count[2] = {0.0, 0.0};
    Eigen::Vector2d towards = Eigen::Vector2d::Zero();
  };
  const std::size_t n = axis.yz_mm.size();
  std::vector<Rims> rims(views.size() * n);
  for (const RimTangent& tangent : rim_tangents(views, axis)) {
    const double place = std::round((tangent.contact.x_mm - axis.x_first_mm) / axis.x_step_mm);
    if (!(place >= 0.0) || place > static_cast<double>(n) - 1.0) continue;
    Rims& at = rims[tangent.view * n + static_cast<std::size_t>(place)];
    at.sum[tangent.upper] += tangent.contact.distance_mm;
    at.count[tangent.upper] += 1.0;
    if (tangent.upper) at.towards = (axis.R_line * tangent.contact.normal).tail<2>().normalized();
  }
  std::vector<Middle> found;
  for (std::size_t r = 0; r < rims.size(); ++r) {
    const Rims& at = rims[r];
    if (!(at.count[0] > 0.0 && at.count[1] > 0.0)) continue;
    const double upper = at.sum[1] / at.count[1], lower = at.sum[0] / at.count[0];
    found.push_back({r % n, r / n, at.towards, 0.5 * (upper - lower), 0.5 * (upper + lower)});
  }
  return found;
}

/// Moves the axis by polynomials to where the middles lie beside it in all views; a middle far off counts little.
void move_axis(AxisCurve& axis, std::span<const Middle> seen, int degree, double scale_mm) {
  const int terms = degree + 1;
  const double last = static_cast<double>(axis.yz_mm.size()) - 1.0;
  const auto powers = [&](std::size_t sample) {
    Eigen::VectorXd p(terms);
    const double t = 2.0 * static_cast<double>(sample) / last - 1.0;
    p(0) = 1.0;
    for (int k = 1; k < terms; ++k) p(k) = t * p(k - 1);
    return p;
  };
  Eigen::VectorXd solution = Eigen::VectorXd::Zero(2 * terms);
  for (int iteration = 0; iteration < 4; ++iteration) {
    Eigen::MatrixXd normal = 1e-6 * static_cast<double>(seen.size()) * Eigen::MatrixXd::Identity(2 * terms, 2 * terms);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(2 * terms);
    for (const Middle& one : seen) {
      const Eigen::VectorXd p = powers(one.sample);
      Eigen::VectorXd row(2 * terms);
      row << one.towards.x() * p, one.towards.y() * p;
      const double off = (one.beside_mm - row.dot(solution)) / scale_mm;
      const double w = 1.0 / (1.0 + off * off);
      normal += w * row * row.transpose();
      right += w * one.beside_mm * row;
    }
    solution = normal.ldlt().solve(right);
    if (!solution.allFinite()) return;
  }
  for (std::size_t i = 0; i < axis.yz_mm.size(); ++i) {
    const Eigen::VectorXd p = powers(i);
    axis.yz_mm[i] += Eigen::Vector2d(p.dot(solution.head(terms)), p.dot(solution.tail(terms)));
  }
  axis.set_slopes();
}

/// The samples between which two views at least see both rims: what lies beyond is not for a polynomial to say.
std::pair<std::size_t, std::size_t> told(std::span<const Middle> seen, std::size_t samples) {
  constexpr std::size_t kTogether = 10;  // samples that share what the views see
  std::vector<std::set<std::size_t>> views(samples / kTogether + 1);
  for (const Middle& one : seen) views[one.sample / kTogether].insert(one.view);
  const auto two = [](const auto& some) { return some.size() > 1; };
  const auto first = std::find_if(views.begin(), views.end(), two);
  if (first == views.end()) return {0, samples - 1};
  const auto last = std::find_if(views.rbegin(), views.rend(), two).base();
  return {kTogether * static_cast<std::size_t>(first - views.begin()),
          std::min(kTogether * static_cast<std::size_t>(last - views.begin()), samples) - 1};
}

/// Lets the axis run straight on from samples `first` and `last` to its ends.
void straighten_beyond(AxisCurve& axis, std::size_t first, std::size_t last) {
  const std::size_t chord = (last - first) / 8;
  if (chord == 0) return;
  const auto run_on = [&](std::size_t from, std::size_t inward, std::size_t i) {
    const Eigen::Vector2d slope =
        (axis.yz_mm[from] - axis.yz_mm[inward]) / (static_cast<double>(from) - static_cast<double>(inward));
    axis.yz_mm[i] = axis.yz_mm[from] + (static_cast<double>(i) - static_cast<double>(from)) * slope;
  };
  for (std::size_t i = 0; i < first; ++i) run_on(first, first + chord, i);
  for (std::size_t i = last + 1; i < axis.yz_mm.size(); ++i) run_on(last, last - chord, i);
  axis.set_slopes();
}

}  // namespace

RodConsensus faceted_rod(std::span<const CameraView> views, AxisCurve start) {
  RodConsensus rod{.axis = std::move(start), .radius_mm = {}};
  const std::size_t n = rod.axis.yz_mm.size();
  std::vector<Middle> seen;
  for (const int degree : {1, 3, 5, 5}) {
    seen = middles(views, rod.axis);
    if (seen.empty()) break;
    double size = 0.0;
    for (const Middle& one : seen) size += one.half_width_mm / static_cast<double>(seen.size());
    move_axis(rod.axis, seen, degree, 0.02 * size);
    const auto [first, last] = told(seen, n);
    straighten_beyond(rod.axis, first, last);
  }
  std::vector<double> sum(n, 0.0), count(n, 0.0);
  double all = 0.0;
  for (const Middle& one : seen) {
    sum[one.sample] += one.half_width_mm, count[one.sample] += 1.0;
    all += one.half_width_mm / static_cast<double>(seen.size());
  }
  double last = all;
  for (std::size_t i = 0; i < n; ++i) {
    if (count[i] > 0.0) last = sum[i] / count[i];
    rod.radius_mm.push_back(last);
  }
  rod.scatter_mm = kScatterShare * all;
  return rod;
}

}  // namespace imprint
