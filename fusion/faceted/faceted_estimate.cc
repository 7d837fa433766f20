#include "fusion/faceted/faceted_estimate.h"

#include <algorithm>
#include <cmath>

#include "fusion/combine/tangent_rows.h"
#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr double kTogether = 3.0;    // tangents of a rim that haze and filtering move together, at least
constexpr double kLeastNoise = 0.2;  // of the stated sigma
constexpr std::size_t kEnoughObservations = 3;
constexpr double kFreedom = 4.0;            // of Student's t for the tangents
constexpr double kMedianOfSquare = 0.4549;  // of a squared normal value
constexpr double kMostFollowed = 0.8;       // of the noise by the fit, beyond which the rest says too little
constexpr double kPlaceShare = 0.02;        // variance of a station's place along x, in squared steps between nodes
constexpr double kWander = 0.01;            // of the size, by which corners leave their middle over the length
constexpr double kStepFreedom = 4.0;        // of Student's t for that; a shoulder is free
constexpr double kBend = 0.1;               // of the size, by which their middle leaves the start's axis
constexpr double kRadiusShare = 0.5;        // sigma of the corners' radius about the start's
constexpr double kRadiusWander = 0.3;       // and of its change along the forging
// Of the section's size: what a forging of a family departs from it.
constexpr double kNotAffine = 0.02, kNotSimilar = 0.01, kConvexNotAffine = 0.2;

template <int kCorners>
class FacetedSolver {
  static constexpr int kCoordinates = 2 * kCorners;
  static constexpr int kUnknowns = kCoordinates + 1;
  using Coordinates = Eigen::Matrix<double, kCoordinates, kCoordinates>;
  using System = BorderedChain<kUnknowns>;
  using Matrix = typename System::Matrix;
  using Vector = typename System::Vector;

  /// A tangent and the corner it touches.
  struct Equation : PlacedEquation {
    int corner = 0;
    Eigen::Vector2d normal;
    double extra_variance_mm2 = 0.0;

    [[nodiscard]] Vector coefficients() const {
      Vector g = Vector::Zero();
      g.template segment<2>(2 * corner) = normal;
      g(kUnknowns - 1) = 1.0;
      return g;
    }
  };

 public:
  FacetedSolver(std::span<const ObservedForging> observations, const JointStart& start,
                std::span<const CornerModel> sections, SectionKind kind, const CombineConfig& config)
      : config_(config),
        axis_(start.axis),
        step_mm_(start.axis.x_step_mm),
        length_mm_(step_mm_ * static_cast<double>(sections.size() - 1)),
        size_mm_(0.5 * measures_of(sections[sections.size() / 2], kind)(kMeanWidth)),
        end_margin_mm_(end_margin_mm(step_mm_, start.shift_sigma_mm, size_mm_)),
        start_radius_mm_(std::max(sections[sections.size() / 2].radius_mm, 0.02 * size_mm_)),
        tangents_(tangent_rows(observations)),
        places_(tangents_.viewers, start.placements, length_mm_, size_mm_, start.shift_sigma_mm, config),
        system_(std::make_shared<System>(static_cast<int>(sections.size()), places_.unknowns())),
        density_(std::pow(kWander * size_mm_, 2) / length_mm_),
        bend_density_(kCorners * std::pow(kBend * size_mm_, 2) / length_mm_),
        trust_(sections.size() - 1, 1.0) {
    for (const CornerModel& section : sections) {
      Vector node;
      for (int i = 0; i < kCorners; ++i) node.template segment<2>(2 * i) = section.corners_mm.col(i);
      node(kUnknowns - 1) = section.radius_mm;
      nodes_.push_back(node);
    }
    find_drift();
    // What is said of the whole forging, not of each node for itself.
    const double shared = 2.0 / static_cast<double>(nodes_.size());
    const auto precision = [&](double share) { return shared / std::pow(share * size_mm_, 2); };
    const FamilyProjections family = family_projections(kCorners);
    prior_ = precision(kind == SectionKind::convex ? kConvexNotAffine : kNotAffine) * family.not_affine;
    if (kind == SectionKind::square || kind == SectionKind::octagon)
      prior_ += precision(kNotSimilar) * family.affine_not_similar;
    radius_precision_ = shared / std::pow(kRadiusShare * start_radius_mm_, 2);
  }

  std::optional<FacetedEstimate> run() {
    for (int round = 0; round < config_.iterations + 2; ++round)
      if (!improve(round)) return std::nullopt;
    std::vector<std::optional<Equation>> equations;
    if (!solve(equations)) return std::nullopt;
    FacetedEstimate estimate;
    estimate.step_mm = step_mm_;
    system_->add_border_covariance(own_);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      CornerModel section;
      section.corners_mm.resize(2, kCorners);
      for (int c = 0; c < kCorners; ++c) section.corners_mm.col(c) = nodes_[i].template segment<2>(2 * c);
      section.radius_mm = nodes_[i](kUnknowns - 1);
      estimate.nodes.push_back(std::move(section));
      estimate.covariance.emplace_back(own_[i]);
    }
    estimate.placements = places_.placements();
    estimate.shift_sigma_mm = places_.shift_sigma_mm(system_->border_covariance());
    estimate.covariance_with = [system = system_](const Eigen::MatrixXd& sums) {
      return system->covariance_with(sums);
    };
    return estimate;
  }

 private:
  /// How each corner leaves the axis' bend from node to node of the start, in the median: a twist or a taper goes on
  /// where no tangent shows it.
  void find_drift() {
    constexpr std::size_t kApart = 50;
    drift_mm_.setZero();
    if (nodes_.size() <= 2 * kApart) return;
    for (int j = 0; j < kCoordinates; ++j) {
      std::vector<double> changes;
      for (std::size_t i = 0; i + kApart < nodes_.size(); ++i)
        changes.push_back(nodes_[i + kApart](j) - nodes_[i](j) - (axis_.yz_mm[i + kApart] - axis_.yz_mm[i])(j % 2));
      drift_mm_(j) = median(std::move(changes)) / static_cast<double>(kApart);
    }
  }
  /// What a corner's coordinate is expected to change by from node i to the next.
  [[nodiscard]] double expected_mm(std::size_t i, int j) const {
    return (axis_.yz_mm[i + 1] - axis_.yz_mm[i])(j % 2) + drift_mm_(j);
  }

  [[nodiscard]] std::optional<Equation> equation_of(TangentRow& row) const {
    const Eigen::Vector3d center = places_.center_of(row.viewer);
    const Eigen::Vector3d ray = places_.placement_of(row.viewer).R * row.ray_world;
    const auto met = touch(axis_, center, ray, row.x_mm);
    if (!met) return std::nullopt;
    row.x_mm = met->x_mm;
    const double flat = met->normal.tail<2>().norm();
    Equation e;
    e.normal = met->normal.tail<2>() / flat;
    const auto near = static_cast<std::size_t>(
        std::clamp(std::lround(row.x_mm / step_mm_), 0L, static_cast<long>(nodes_.size()) - 1));
    double furthest = -1e300;
    for (int c = 0; c < kCorners; ++c) {
      const double reach = e.normal.dot(nodes_[near].template segment<2>(2 * c));
      if (reach > furthest) furthest = reach, e.corner = c;
    }
    // On along the ray to where that corner touches it.
    const double across = ray.tail<2>().norm();
    const Eigen::Vector2d beside =
        nodes_[near].template segment<2>(2 * e.corner) - axis_.at(row.x_mm).point_mm.tail<2>();
    const Eigen::Vector3d point = center + (met->range_mm + beside.dot(ray.tail<2>()) / (across * across)) * ray;
    // Near an end the ray may touch the end face's outline instead.
    if (!(point.x() > end_margin_mm_) || point.x() > length_mm_ - end_margin_mm_) return std::nullopt;
    const double place = std::clamp(point.x() / step_mm_, 0.0, static_cast<double>(nodes_.size()) - 1.001);
    e.node = static_cast<std::size_t>(place);
    e.share = place - static_cast<double>(e.node);
    e.along = std::clamp(point.x() / length_mm_, 0.0, 1.0);
    e.value_mm = (met->offset_mm - met->normal.x() * point.x()) / flat;
    set_place_effects(e, center, point, met->normal / flat, length_mm_);
    const Eigen::Vector2d slope = (nodes_[e.node + 1] - nodes_[e.node]).template segment<2>(2 * e.corner) / step_mm_;
    const Eigen::Vector2d bend = axis_.at(point.x()).direction.tail<2>();
    e.extra_variance_mm2 = std::pow(e.normal.dot(slope - bend), 2) * kPlaceShare * step_mm_ * step_mm_;
    return e;
  }

  [[nodiscard]] double residual_of(const Equation& e, std::size_t viewer) const {
    const Vector node = (1.0 - e.share) * nodes_[e.node] + e.share * nodes_[e.node + 1];
    return e.value_mm - e.normal.dot(node.template segment<2>(2 * e.corner)) - node(kUnknowns - 1) -
           places_.made_by_places(e, viewer, system_->border_solution);
  }

  /// What all corners do alike.
  static Coordinates together_only() {
    Coordinates alike = Coordinates::Zero();
    for (int j = 0; j < kCoordinates; ++j)
      for (int k = j % 2; k < kCoordinates; k += 2) alike(j, k) = 1.0 / kCorners;
    return alike;
  }

  void add_prior() {
    const double wander = std::pow(kRadiusWander * start_radius_mm_, 2) / length_mm_;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      Matrix& own = system_->diagonal[i];
      own.template topLeftCorner<kCoordinates, kCoordinates>() += prior_;
      own.diagonal().array() += 1e-9 / (size_mm_ * size_mm_);
      own(kUnknowns - 1, kUnknowns - 1) += radius_precision_;
      system_->right[i](kUnknowns - 1) += radius_precision_ * start_radius_mm_;
      if (i + 1 == nodes_.size()) continue;
      Matrix precision = Matrix::Zero();
      precision(kUnknowns - 1, kUnknowns - 1) = 1.0 / (wander * step_mm_);
      precision.template topLeftCorner<kCoordinates, kCoordinates>() =
          trust_[i] / (density_ * step_mm_) * (Coordinates::Identity() - together_only()) +
          together_only() / (bend_density_ * step_mm_);
      own += precision;
      system_->diagonal[i + 1] += precision;
      system_->upper[i] -= precision;
      Vector expected = Vector::Zero();
      for (int j = 0; j < kCoordinates; ++j) expected(j) = expected_mm(i, j);
      system_->right[i] -= precision * expected;
      system_->right[i + 1] += precision * expected;
    }
  }

  bool solve(std::vector<std::optional<Equation>>& equations) {
    system_->clear();
    add_prior();
    places_.add_priors(axis_.yz_mm.front(), axis_.yz_mm.back(), system_->corner, system_->border_right);
    equations.clear();
    for (TangentRow& row : tangents_.rows) equations.push_back(equation_of(row));
    if (!(noise_scale_ > 0.0)) noise_scale_ = first_scatter(equations);
    for (std::size_t r = 0; r < equations.size(); ++r) {
      if (!equations[r]) continue;
      const TangentRow& row = tangents_.rows[r];
      const double w =
          row.trust / (row.variance_mm2 * noise_scale_ * noise_scale_ * together_ + equations[r]->extra_variance_mm2);
      places_.add(*system_, equations[r]->coefficients(), *equations[r], row.viewer, w);
    }
    if (!system_->solve()) return false;
    system_->node_covariances(own_, with_next_);
    return true;
  }

  [[nodiscard]] double first_scatter(std::span<const std::optional<Equation>> equations) const {
    std::vector<std::optional<double>> off;
    for (const auto& e : equations) {
      if (!e) {
        off.emplace_back();
        continue;
      }
      const Vector node = (1.0 - e->share) * nodes_[e->node] + e->share * nodes_[e->node + 1];
      off.emplace_back(e->value_mm - e->coefficients().dot(node));
    }
    return std::max(kLeastNoise, rim_scatter(tangents_, off));
  }

  bool improve(int round) {
    constexpr int kRoughRounds = 2;  // in which observations still move and tangents change their corner
    std::vector<std::optional<Equation>> equations;
    if (!solve(equations)) return false;
    nodes_ = system_->node_solution;
    std::vector<double> squares;  // of the deviations, in the stated variances
    double followed = 0.0;        // of the noise, by the fit: what its freedom takes from those squares
    for (std::size_t r = 0; r < equations.size(); ++r) {
      TangentRow& row = tangents_.rows[r];
      row.used = equations[r].has_value();
      if (!row.used) continue;
      const Equation& e = *equations[r];
      row.residual_mm = residual_of(e, row.viewer);
      const Vector g = e.coefficients();
      const double here = 1.0 - e.share;
      const double fitted = here * here * g.dot(own_[e.node] * g) + e.share * e.share * g.dot(own_[e.node + 1] * g) +
                            2.0 * here * e.share * g.dot(with_next_[e.node] * g);
      const double expected = row.residual_mm * row.residual_mm + fitted;
      squares.push_back(row.residual_mm * row.residual_mm / row.variance_mm2);
      const double noise = row.variance_mm2 * noise_scale_ * noise_scale_;
      followed += std::min(fitted / (noise * together_), 1.0);
      const double variance = noise + e.extra_variance_mm2;
      row.trust = (kFreedom + 1.0) / (kFreedom + expected / variance);
    }
    places_.take(system_->border_solution);
    if (squares.empty()) return false;
    if (round < kRoughRounds) return true;
    // Of few observations the sections can follow any noise: then what the rims scatter at first has to do.
    if (places_.placements().size() >= kEnoughObservations) {
      const double left = 1.0 - std::min(followed / static_cast<double>(squares.size()), kMostFollowed);
      noise_scale_ = std::max(kLeastNoise, std::sqrt(median(std::move(squares)) / kMedianOfSquare / left));
    }
    together_ = std::max(kTogether, moved_together(tangents_, noise_scale_));
    learn();
    return true;
  }

  void learn() {
    const Coordinates alike = together_only();
    std::vector<double> apart;
    double bend = 0.0;
    for (std::size_t i = 0; i + 1 < nodes_.size(); ++i) {
      Eigen::Matrix<double, kCoordinates, 1> change;
      for (int j = 0; j < kCoordinates; ++j) change(j) = nodes_[i + 1](j) - nodes_[i](j) - expected_mm(i, j);
      const auto of = [](const Matrix& m) { return m.template topLeftCorner<kCoordinates, kCoordinates>(); };
      const Coordinates moved = change * change.transpose() + of(own_[i]) + of(own_[i + 1]) - of(with_next_[i]) -
                                of(with_next_[i]).transpose();
      const double common = alike.cwiseProduct(moved).sum();
      bend += common / 2.0;
      apart.push_back((moved.trace() - common) / (kCoordinates - 2));
    }
    // Expectation maximisation, step by step: where no tangent shows a change it stays what a forging usually does.
    const double variance = density_ * step_mm_;
    double sum = 0.0;
    for (std::size_t i = 0; i < trust_.size(); ++i) {
      trust_[i] = (kStepFreedom + 1.0) / (kStepFreedom + apart[i] / variance);
      sum += trust_[i] * apart[i];
    }
    const double steps = static_cast<double>(trust_.size()) * step_mm_;
    density_ = sum / steps;
    bend_density_ = bend / steps;
  }

  CombineConfig config_;
  AxisCurve axis_;  ///< of the start: what the corners go along with
  double step_mm_, length_mm_, size_mm_, end_margin_mm_, start_radius_mm_;
  TangentRows tangents_;
  ViewerPlaces places_;
  std::shared_ptr<System> system_;
  std::vector<Vector> nodes_;
  std::vector<Matrix> own_, with_next_;
  Coordinates prior_;
  Eigen::Matrix<double, kCoordinates, 1> drift_mm_;
  double radius_precision_ = 0.0;
  double density_;       ///< mm^2 of variance per mm of a corner's place about the corners' middle
  double bend_density_;  ///< and of that middle about the start's axis, times the corners
  std::vector<double> trust_;
  double noise_scale_ = 0.0, together_ = kTogether;
};

}  // namespace

AxisCurve FacetedEstimate::axis() const {
  AxisCurve curve;
  curve.x_step_mm = step_mm;
  for (const CornerModel& node : nodes) curve.yz_mm.emplace_back(node.center());
  curve.set_slopes();
  return curve;
}

std::optional<FacetedEstimate> estimate_faceted(std::span<const ObservedForging> observations, const JointStart& start,
                                                std::span<const CornerModel> sections_mm, SectionKind kind,
                                                const CombineConfig& config) {
  switch (sections_mm.front().size()) {
    case 4:
      return FacetedSolver<4>(observations, start, sections_mm, kind, config).run();
    case 8:
      return FacetedSolver<8>(observations, start, sections_mm, kind, config).run();
    default:
      return FacetedSolver<12>(observations, start, sections_mm, kind, config).run();
  }
}

}  // namespace imprint
