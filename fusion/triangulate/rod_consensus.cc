#include "fusion/triangulate/rod_consensus.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <Eigen/Dense>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr int kLargestDegree = 7;  // of the axis
constexpr int kStepReach = 3;      // samples about a step of the radius where any radius between is on the rod

/// Scale of the loss in radii and degree of the axis, round by round. The last scale leaves room for out-of-round.
struct Round {
  double scale_share;
  int degree;
};
constexpr std::array<Round, 9> kRounds{
    {{0.12, 1}, {0.08, 1}, {0.06, 2}, {0.045, 3}, {0.035, 4}, {0.028, 5}, {0.022, 6}, {0.02, 7}, {0.02, 7}}};

double squared(double value) { return value * value; }

/// Weight of a residual under Geman and McClure's loss z^2 / (1 + z^2).
double redescending(double residual, double scale) { return squared(1.0 / (1.0 + squared(residual / scale))); }

std::size_t sample_of(const AxisCurve& axis, double x_mm) {
  const double last = static_cast<double>(axis.yz_mm.size()) - 1.0;
  return static_cast<std::size_t>(std::clamp(std::round((x_mm - axis.x_first_mm) / axis.x_step_mm), 0.0, last));
}

bool within(const AxisCurve& axis, double x_mm) {
  const double position = (x_mm - axis.x_first_mm) / axis.x_step_mm;
  return position > -1.0 && position < static_cast<double>(axis.yz_mm.size());
}

/// Radius along the axis by dynamic programming: every rim point rewards the radii near its own distance that others
/// see too, a change of radius costs, but never more than a step does.
class RadiusPath {
 public:
  RadiusPath(const ForgingSpec& forging, double scale_mm)
      : low_mm_(0.4 * forging.diameter_min_mm),
        pitch_mm_((0.6 * forging.diameter_max_mm - low_mm_) / (kLevels - 1)),
        scale_mm_(scale_mm) {}

  std::vector<double> find(const AxisCurve& axis, std::span<const RimTangent> tangents) const {
    const std::size_t n = axis.yz_mm.size();
    std::vector<Levels> reward(n, Levels::Zero()), best(n, Levels::Zero());
    const Levels radii = Levels::LinSpaced(static_cast<float>(radius(0)), static_cast<float>(radius(kLevels - 1)));
    const float scale = static_cast<float>(scale_mm_);
    for (const RimTangent& tangent : tangents) {
      if (!within(axis, tangent.contact.x_mm)) continue;
      const std::size_t at = sample_of(axis, tangent.contact.x_mm);
      const float distance = static_cast<float>(tangent.contact.distance_mm),
                  weight = static_cast<float>(tangent.weight);
      const Levels agreement = weight / (1.0F + ((distance - radii) / scale).square());
      reward[at] += agreement;
      best[at] = best[at].max(agreement);
    }
    for (std::size_t i = 0; i < n; ++i) reward[i] -= (1.0F - kAlone) * best[i];
    return refined(best_path(reward), axis, tangents);
  }

 private:
  static constexpr int kLevels = 200;
  // In units of what one rim point in full agreement gives.
  static constexpr float kStepCost = 6.0F;
  static constexpr float kLevelCost = 0.5F;
  static constexpr float kAlone = 0.1F;  ///< what a rim that no other one agrees with counts: it may follow a beam
  static constexpr int kTaper = 3;       // levels; a step changes more within a few samples
  using Levels = Eigen::Array<float, kLevels, 1>;  // thousands a forging: half the memory, twice the speed

  [[nodiscard]] double radius(int level) const { return low_mm_ + pitch_mm_ * level; }

  static std::vector<int> best_path(std::span<const Levels> reward) {
    const std::size_t n = reward.size();
    std::vector<std::array<std::int16_t, kLevels>> from(n);
    Levels total = reward[0];
    for (std::size_t i = 1; i < n; ++i) {
      Eigen::Index top = 0;
      const float stepped = total.maxCoeff(&top) - kStepCost;
      for (int level = 0; level < kLevels; ++level)
        from[i][static_cast<std::size_t>(level)] = static_cast<std::int16_t>(level);
      // Two sweeps carry every total to its neighbours for the price of the levels between.
      const auto carry = [&](int level, int neighbour) {  // without a branch, which nobody could predict
        const float carried = total(neighbour) - kLevelCost;
        std::int16_t& origin = from[i][static_cast<std::size_t>(level)];
        const bool better = carried > total(level);
        origin = better ? from[i][static_cast<std::size_t>(neighbour)] : origin;
        total(level) = better ? carried : total(level);
      };
      for (int level = 1; level < kLevels; ++level) carry(level, level - 1);
      for (int level = kLevels - 2; level >= 0; --level) carry(level, level + 1);
      for (int level = 0; level < kLevels; ++level) {
        if (stepped <= total(level)) continue;
        total(level) = stepped;
        from[i][static_cast<std::size_t>(level)] = static_cast<std::int16_t>(top);
      }
      total += reward[i];
    }
    std::vector<int> path(n);
    Eigen::Index last = 0;
    total.maxCoeff(&last);
    path[n - 1] = static_cast<int>(last);
    for (std::size_t i = n - 1; i > 0; --i) path[i - 1] = from[i][static_cast<std::size_t>(path[i])];
    return path;
  }

  /// Finer than the levels: the mean of the rim points near the path, over a few samples on the same side of any step.
  std::vector<double> refined(const std::vector<int>& path, const AxisCurve& axis,
                              std::span<const RimTangent> tangents) const {
    const int n = static_cast<int>(path.size());
    std::vector<double> sum(path.size(), 0.0);
    std::vector<double> weights(path.size(), 0.0);
    for (const RimTangent& tangent : tangents) {
      if (!within(axis, tangent.contact.x_mm)) continue;
      const int at = static_cast<int>(sample_of(axis, tangent.contact.x_mm));
      for (int i = std::max(0, at - kStepReach); i <= std::min(n - 1, at + kStepReach); ++i) {
        if (std::abs(path[static_cast<std::size_t>(i)] - path[static_cast<std::size_t>(at)]) > kTaper) continue;
        const double level = radius(path[static_cast<std::size_t>(i)]);
        const double w = tangent.weight * redescending(tangent.contact.distance_mm - level, scale_mm_);
        sum[static_cast<std::size_t>(i)] += w * (tangent.contact.distance_mm - level);
        weights[static_cast<std::size_t>(i)] += w;
      }
    }
    std::vector<double> radii(path.size());
    for (std::size_t i = 0; i < path.size(); ++i) radii[i] = radius(path[i]) + sum[i] / (weights[i] + 0.5);
    return radii;
  }

  double low_mm_;
  double pitch_mm_;
  double scale_mm_;
};

/// Legendre polynomials 0 to kLargestDegree over the samples of an axis.
using Polynomials = Eigen::Matrix<double, kLargestDegree + 1, 1>;
Polynomials legendre(double t) {
  Polynomials p;
  p(0) = 1.0;
  p(1) = t;
  for (int k = 2; k <= kLargestDegree; ++k) p(k) = ((2 * k - 1) * t * p(k - 1) - (k - 1) * p(k - 2)) / k;
  return p;
}

double from_minus_one_to_one(const AxisCurve& axis, double x_mm) {
  const double half = 0.5 * axis.x_step_mm * static_cast<double>(axis.yz_mm.size() - 1);
  return std::clamp((x_mm - axis.x_first_mm) / half - 1.0, -1.0, 1.0);
}

/// Moves the axis of `rod` to where the rim points lie evenly about it.
void move_axis(RodConsensus& rod, std::span<const RimTangent> tangents, int degree, double scale_mm) {
  const int terms = degree + 1;
  struct Term {
    Eigen::VectorXd row;
    double deviation;
    double weight;
  };
  std::vector<Term> equations;
  for (const RimTangent& tangent : tangents) {
    if (!within(rod.axis, tangent.contact.x_mm)) continue;
    const Eigen::Vector3d normal = rod.axis.R_line * tangent.contact.normal;
    const Eigen::VectorXd p = legendre(from_minus_one_to_one(rod.axis, tangent.contact.x_mm)).head(terms);
    Eigen::VectorXd row(2 * terms);
    row << normal.y() * p, normal.z() * p;
    equations.push_back({std::move(row), rod.deviation_mm(tangent.contact), tangent.weight});
  }
  Eigen::VectorXd solution = Eigen::VectorXd::Zero(2 * terms);
  for (int iteration = 0; iteration < 5; ++iteration) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(2 * terms, 2 * terms);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(2 * terms);
    for (const Term& term : equations) {
      const double w = term.weight * redescending(term.deviation - term.row.dot(solution), scale_mm);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(term.row, w);
      right += w * term.deviation * term.row;
    }
    // Stretches that few rims see bend no further than they must.
    normal.diagonal().array() += 1e-3 * static_cast<double>(equations.size()) / (2 * terms);
    solution = normal.selfadjointView<Eigen::Lower>().ldlt().solve(right);
    if (!solution.allFinite()) return;
  }
  for (std::size_t i = 0; i < rod.axis.yz_mm.size(); ++i) {
    const double x = rod.axis.x_first_mm + rod.axis.x_step_mm * static_cast<double>(i);
    const Eigen::VectorXd p = legendre(from_minus_one_to_one(rod.axis, x)).head(terms);
    rod.axis.yz_mm[i] += Eigen::Vector2d(p.dot(solution.head(terms)), p.dot(solution.tail(terms)));
  }
  rod.axis.set_slopes();
}

}  // namespace

double RodConsensus::deviation_mm(const RimContact& contact) const {
  const std::size_t at = sample_of(axis, contact.x_mm);
  const auto first = radius_mm.begin() + static_cast<std::ptrdiff_t>(at < kStepReach ? 0 : at - kStepReach);
  const auto last = radius_mm.begin() + static_cast<std::ptrdiff_t>(std::min(at + kStepReach + 1, radius_mm.size()));
  const auto [least, most] = std::minmax_element(first, last);
  // Without a step close by the radius here counts, not the spread of its neighbours.
  const bool step = *most - *least > 0.02 * *most;
  const double low = step ? *least : radius_mm[at];
  const double high = step ? *most : radius_mm[at];
  return contact.distance_mm - std::clamp(contact.distance_mm, low, high);
}

double RodConsensus::tolerance_mm() const { return std::max(4.0 * scatter_mm, 0.015 * median(radius_mm)); }

double RodConsensus::median_radius_mm(double from_x_mm, double to_x_mm) const {
  const std::size_t first = sample_of(axis, from_x_mm);
  const std::size_t last = std::max(sample_of(axis, to_x_mm), first) + 1;
  return median(
      {radius_mm.begin() + static_cast<std::ptrdiff_t>(first), radius_mm.begin() + static_cast<std::ptrdiff_t>(last)});
}

RodConsensus agree_on_rod(std::span<const CameraView> views, AxisCurve start, const ForgingSpec& forging) {
  RodConsensus rod{.axis = std::move(start), .radius_mm = {}};
  std::vector<RimTangent> tangents;
  double radius = 0.25 * (forging.diameter_min_mm + forging.diameter_max_mm);
  for (const Round& round : kRounds) {
    const double scale = round.scale_share * radius;
    tangents = rim_tangents(views, rod.axis);
    rod.radius_mm = RadiusPath(forging, scale).find(rod.axis, tangents);
    move_axis(rod, tangents, round.degree, scale);
    radius = median(rod.radius_mm);
  }
  tangents = rim_tangents(views, rod.axis);
  rod.radius_mm = RadiusPath(forging, kRounds.back().scale_share * radius).find(rod.axis, tangents);
  std::vector<double> deviations;
  for (const RimTangent& tangent : tangents)
    if (within(rod.axis, tangent.contact.x_mm)) {
      const double deviation = std::abs(rod.deviation_mm(tangent.contact));
      if (deviation < 3.0 * kRounds.back().scale_share * radius) deviations.push_back(deviation);
    }
  rod.scatter_mm = 1.4826 * median(std::move(deviations));
  return rod;
}

}  // namespace imprint
