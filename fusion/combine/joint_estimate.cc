#include "fusion/combine/joint_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "fusion/combine/rod_surface.h"
#include "fusion/combine/tangent_rows.h"
#include "fusion/combine/unseen_steps.h"
#include "lib/geometry/rotation.h"

namespace imprint {
namespace {

constexpr int kCameraUnknowns = 2;         // its place across the axis, at both ends
constexpr int kPlaceUnknowns = 6;          // shift x, y, z and turn about x, y, z of an observation
constexpr double kTogether = 3.0;          // tangents of a rim that haze and filtering move together, at least
constexpr double kLeastNoise = 0.2;        // of the stated sigma: exact input must not make the equations singular
constexpr double kLeastOutOfRound = 7e-3;  // of the radius: what a forging may be before it counts as a fault
constexpr double kFreedom = 4.0;           // of Student's t for the tangents
constexpr double kStartShare = 0.05;       // sigma of the start's radius, of the radius
constexpr double kPlaceShare = 0.02;       // variance of a station's place along x, in squared steps between nodes

class JointSolver {
 public:
  JointSolver(std::span<const ObservedForging> observations, std::vector<Placement> placements, const AxisCurve& start,
              std::span<const double> start_radius_mm, double shift_sigma_mm, const CombineConfig& config)
      : config_(config),
        placements_(std::move(placements)),
        step_mm_(start.x_step_mm),
        length_mm_(start.x_step_mm * static_cast<double>(start.yz_mm.size() - 1)),
        shift_sigma_mm_(shift_sigma_mm),
        radius_mm_(median(start_radius_mm)),
        end_margin_(1.0 + 2.0 * shift_sigma_mm / start.x_step_mm),
        prior_(unseen_steps(observations, start_radius_mm, start.x_step_mm), start.x_step_mm, radius_mm_,
               config.out_of_round_share, config.out_of_round_length_share * length_mm_),
        system_(0, 0) {
    nodes_.assign(start.yz_mm.size(), NodeVector::Zero());
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      nodes_[i](kY) = start.yz_mm[i].x();
      nodes_[i](kZ) = start.yz_mm[i].y();
      nodes_[i](kYSlope) = start.slope[i].x();
      nodes_[i](kZSlope) = start.slope[i].y();
      nodes_[i](kRadius) = start_radius_mm[i];
    }
    constexpr std::size_t kReach = 3;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const auto near = start_radius_mm.subspan(i < kReach ? 0 : i - kReach);
      const auto [low, high] = std::minmax_element(
          near.begin(), near.begin() + static_cast<std::ptrdiff_t>(std::min(near.size(), 2 * kReach + 2)));
      const bool step = *high - *low > 0.02 * *high;
      radius_range_.emplace_back(step ? *low : start_radius_mm[i], step ? *high : start_radius_mm[i]);
    }
    start_ = nodes_;
    TangentRows all = tangent_rows(observations);
    viewers_ = std::move(all.viewers);
    rows_ = std::move(all.rows);
    std::vector<double> out_of_round;
    for (const ObservedForging& observed : observations) out_of_round.push_back(observed.out_of_round_mm);
    out_of_round_mm_ = std::max(median(out_of_round), kLeastOutOfRound * radius_mm_);
    place_sum_.assign(observations.size(), Vector6d::Zero());
    camera_solution_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(viewers_.size()) * kCameraUnknowns);
  }

  std::optional<JointEstimate> run() {
    for (int iteration = 0; iteration < config_.iterations; ++iteration)
      if (!improve(iteration + 1 == config_.iterations)) return std::nullopt;
    together_ = std::max(kTogether, moved_together(rows_, noise_scale_));
    std::vector<std::optional<TangentEquation>> equations;
    if (!solve(Use::interval, equations)) return std::nullopt;
    JointEstimate estimate;
    estimate.step_mm = step_mm_;
    estimate.nodes = nodes_;
    estimate.covariance = std::move(own_);
    system_.add_border_covariance(estimate.covariance);
    estimate.placements = placements_;
    estimate.scatter_share = noise_scale_;
    estimate.shift_sigma_mm.assign(placements_.size(), 0.0);
    const Eigen::MatrixXd border = system_.border_covariance();
    for (std::size_t k = 1; k < placements_.size(); ++k)
      estimate.shift_sigma_mm[k] = std::sqrt(border(place_column(k), place_column(k)));
    estimate.system = std::move(system_);
    return estimate;
  }

 private:
  enum class Use { estimate, interval };

  static double median(std::span<const double> values) {
    std::vector<double> sorted(values.begin(), values.end());
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    return sorted[sorted.size() / 2];
  }

  /// Of a viewer's unknowns in the border.
  static int camera_column(std::size_t viewer) { return static_cast<int>(viewer) * kCameraUnknowns; }
  int place_column(std::size_t observation) const {
    return static_cast<int>(viewers_.size()) * kCameraUnknowns + static_cast<int>(observation - 1) * kPlaceUnknowns;
  }

  /// On a shoulder the value hangs on where along x the ray touches, and so on the out-of-round as far as it is not
  /// known yet.
  double shoulder_variance_mm2(const TangentEquation& equation) const {
    const std::size_t last = nodes_.size() - 1;
    const std::size_t a = equation.node > 0 ? equation.node - 1 : 0;
    const std::size_t b = std::min(equation.node + 2, last);
    const double slope = (nodes_[b](kRadius) - nodes_[a](kRadius)) / (static_cast<double>(b - a) * step_mm_);
    double turning = 0.0;  // variance of d support / d theta
    for (int k = kFirstHarmonic; k <= kLastHarmonic; ++k) {
      const double variance =
          own_.empty()
              ? std::pow(prior_.harmonic_sigma_mm(k), 2)
              : 0.5 * (own_[equation.node](cosine_of(k), cosine_of(k)) + own_[equation.node](sine_of(k), sine_of(k)));
      turning += k * k * variance;
    }
    return slope * slope * (equation.x_per_mm * equation.x_per_mm * turning + kPlaceShare * step_mm_ * step_mm_);
  }

  void add_camera_priors() {
    for (std::size_t v = 0; v < viewers_.size(); ++v) {
      const Viewer& viewer = viewers_[v];
      const Placement& placement = placements_[viewer.observation];
      const Eigen::Vector3d center = placement.point(viewer.center_world_mm);
      Eigen::Matrix<double, 2, 6> effect;
      for (int end = 0; end < 2; ++end) {
        const NodeVector& node = end == 0 ? nodes_.front() : nodes_.back();
        const Eigen::Vector3d point(end * length_mm_, node(kY), node(kZ));
        const Eigen::Vector3d across = (point - center).cross(Eigen::Vector3d::UnitX()).normalized();
        const Eigen::Vector3d across_world = placement.R.transpose() * across;
        const Eigen::Vector3d point_cam = viewer.R_cam_world * placement.R.transpose() * (point - center);
        effect.block<1, 3>(end, 0) = across_world.transpose();
        effect.block<1, 3>(end, 3) = -point_cam.cross(viewer.R_cam_world * across_world).transpose();
      }
      Eigen::Matrix2d covariance = effect * viewer.pose_covariance * effect.transpose();
      covariance.diagonal().array() += std::pow(1e-5 * radius_mm_, 2);
      system_.corner.block<2, 2>(camera_column(v), camera_column(v)) += covariance.inverse();
    }
  }

  void add_place_priors() {
    const double turn_x = config_.rotation_tolerance_deg * M_PI / 180.0;
    Vector6d sigma;
    sigma << shift_sigma_mm_, config_.placing_sigma_mm, config_.placing_sigma_mm, turn_x, 0.02, 0.02;
    for (std::size_t k = 1; k < placements_.size(); ++k) {
      for (int j = 0; j < kPlaceUnknowns; ++j) {
        const double information = 1.0 / (sigma(j) * sigma(j));
        system_.corner(place_column(k) + j, place_column(k) + j) += information;
        system_.border_right(place_column(k) + j) -= information * place_sum_[k](j);
      }
    }
  }

  /// The start's radius, as far as it can be wrong: a stretch that few rims show must not wander off with the wrong
  /// ones.
  void add_start() {
    const double information = 1.0 / std::pow(kStartShare * radius_mm_, 2);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const auto& [low, high] = radius_range_[i];
      if (low < high) continue;  // a shoulder may lie beside where the start has it
      system_.diagonal[i](kRadius, kRadius) += information;
      system_.right[i](kRadius) += information * start_[i](kRadius);
    }
  }

  /// The equations of this round, solved; false when they cannot be.
  bool solve(Use use, std::vector<std::optional<TangentEquation>>& equations) {
    const int border =
        static_cast<int>(viewers_.size()) * kCameraUnknowns + static_cast<int>(placements_.size() - 1) * kPlaceUnknowns;
    system_ = BorderedSystem(static_cast<int>(nodes_.size()), border);
    prior_.add_to(system_);
    if (use == Use::estimate) add_start();
    add_camera_priors();
    add_place_priors();
    const RodSurface rod(nodes_, step_mm_);
    equations.clear();
    equations.reserve(rows_.size());
    for (TangentRow& row : rows_) {
      const Viewer& viewer = viewers_[row.viewer];
      equations.push_back(
          equation_of(row, viewer, placements_[viewer.observation], rod, length_mm_, end_margin_ * step_mm_));
      if (equations.back()) equations.back()->extra_variance_mm2 = shoulder_variance_mm2(*equations.back());
    }
    if (!(noise_scale_ > 0.0)) noise_scale_ = std::max(kLeastNoise, rim_scatter(rows_, equations, start_));
    for (std::size_t r = 0; r < rows_.size(); ++r)
      if (equations[r]) add_equation(rows_[r], *equations[r]);
    if (!system_.solve()) return false;
    system_.node_covariances(own_, with_next_);
    return true;
  }

  bool improve(bool last) {
    std::vector<std::optional<TangentEquation>> equations;
    if (!solve(Use::estimate, equations)) return false;
    nodes_ = system_.node_solution;
    camera_solution_ = system_.border_solution.head(camera_solution_.size());
    find_residuals(equations);
    move_places();
    // The last round leaves amounts and solution belonging to each other.
    if (last) return true;
    weigh(equations);
    prior_.learn(nodes_, own_, with_next_, static_cast<int>(placements_.size()), out_of_round_mm_);
    return true;
  }

  void add_equation(const TangentRow& row, const TangentEquation& equation) {
    const std::size_t i = equation.node;
    const double w =
        row.trust / (row.variance_mm2 * noise_scale_ * noise_scale_ * together_ + equation.extra_variance_mm2);
    const double next = equation.share;
    const double here = 1.0 - next;
    const NodeVector& g = equation.coefficients;
    const NodeMatrix square = w * g * g.transpose();
    system_.diagonal[i] += here * here * square;
    system_.diagonal[i + 1] += next * next * square;
    system_.upper[i] += here * next * square;
    system_.right[i] += w * here * equation.value_mm * g;
    system_.right[i + 1] += w * next * equation.value_mm * g;

    const Viewer& viewer = viewers_[row.viewer];
    std::array<int, kCameraUnknowns + kPlaceUnknowns> columns{camera_column(row.viewer), camera_column(row.viewer) + 1};
    std::array<double, kCameraUnknowns + kPlaceUnknowns> effects{equation.camera * (1.0 - equation.along),
                                                                 equation.camera * equation.along};
    std::size_t count = kCameraUnknowns;
    if (viewer.observation > 0) {
      for (int j = 0; j < kPlaceUnknowns; ++j) {
        columns[count] = place_column(viewer.observation) + j;
        effects[count++] = equation.place(j);
      }
    }
    const auto first = static_cast<Eigen::Index>(i) * kNodeUnknowns;
    for (std::size_t a = 0; a < count; ++a) {
      const double weighted = w * effects[a];
      system_.border.col(columns[a]).segment<kNodeUnknowns>(first) += weighted * here * g;
      system_.border.col(columns[a]).segment<kNodeUnknowns>(first + kNodeUnknowns) += weighted * next * g;
      system_.border_right(columns[a]) += weighted * equation.value_mm;
      for (std::size_t b = 0; b < count; ++b) system_.corner(columns[a], columns[b]) += weighted * effects[b];
    }
  }

  void find_residuals(std::span<const std::optional<TangentEquation>> equations) {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      TangentRow& row = rows_[r];
      row.used = equations[r].has_value();
      if (!row.used) continue;
      const TangentEquation& equation = *equations[r];
      const Viewer& viewer = viewers_[row.viewer];
      const NodeVector node =
          (1.0 - equation.share) * nodes_[equation.node] + equation.share * nodes_[equation.node + 1];
      const int camera = camera_column(row.viewer);
      double model =
          equation.coefficients.dot(node) + equation.camera * ((1.0 - equation.along) * camera_solution_(camera) +
                                                               equation.along * camera_solution_(camera + 1));
      if (viewer.observation > 0)
        model += equation.place.dot(system_.border_solution.segment<kPlaceUnknowns>(place_column(viewer.observation)));
      row.residual_mm = equation.value_mm - model;
      row.from_circle_mm =
          row.residual_mm + equation.coefficients.tail<2 * kHarmonics>().dot(node.tail<2 * kHarmonics>());
    }
  }

  void move_places() {
    const Eigen::Vector3d middle(0.5 * length_mm_, 0.0, 0.0);
    for (std::size_t k = 1; k < placements_.size(); ++k) {
      const Vector6d move = system_.border_solution.segment<kPlaceUnknowns>(place_column(k));
      place_sum_[k] += move;
      const Eigen::Matrix3d turn = rotation_from_vector(move.tail<3>());
      placements_[k].R = turn * placements_[k].R;
      placements_[k].shift_mm = turn * (placements_[k].shift_mm - middle) + middle + move.head<3>();
    }
  }

  /// What lies far out of what the rod is out of round belongs to something else (Tukey's biweight). Next to a step
  /// any radius from the one to the other is on the rod. Of several observations none is silenced for contradicting
  /// the others: one that was turned wrongly has to show.
  double belongs(const TangentRow& row, const TangentEquation& equation) const {
    if (placements_.size() > 1) return 1.0;
    const double radius = (1.0 - equation.share) * nodes_[equation.node](kRadius) +
                          equation.share * nodes_[equation.node + 1](kRadius) + row.from_circle_mm;
    const auto [low, high] = radius_range_[equation.node];
    const double off =
        row.from_circle_mm - std::clamp(row.from_circle_mm, std::min(0.0, low - radius + row.from_circle_mm),
                                        std::max(0.0, high - radius + row.from_circle_mm));
    const double z = off / (4.685 * out_of_round_mm_);
    return std::abs(z) < 1.0 ? (1.0 - z * z) * (1.0 - z * z) : 0.0;
  }

  /// Whom to trust in the next round.
  void weigh(std::span<const std::optional<TangentEquation>> equations) {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      TangentRow& row = rows_[r];
      if (!row.used) continue;
      const TangentEquation& e = *equations[r];
      const NodeVector& g = e.coefficients;
      const double here = 1.0 - e.share;
      const double fitted = here * here * g.dot(own_[e.node] * g) + e.share * e.share * g.dot(own_[e.node + 1] * g) +
                            2.0 * here * e.share * g.dot(with_next_[e.node] * g);
      const double expected = row.residual_mm * row.residual_mm + fitted;
      const double variance = row.variance_mm2 * noise_scale_ * noise_scale_ + e.extra_variance_mm2;
      row.trust = (kFreedom + 1.0) / (kFreedom + expected / variance) * belongs(row, e);
    }
  }

  CombineConfig config_;
  std::vector<Placement> placements_;
  double step_mm_;
  double length_mm_;
  double shift_sigma_mm_;
  double radius_mm_;
  double end_margin_;  ///< nodes next to an end whose tangents may belong to the end circle instead
  SectionPrior prior_;
  BorderedSystem system_;
  std::vector<Viewer> viewers_;
  std::vector<TangentRow> rows_;
  std::vector<NodeVector> nodes_, start_;
  std::vector<NodeMatrix> own_, with_next_;
  std::vector<std::pair<double, double>> radius_range_;  ///< about each node, of the start
  std::vector<Vector6d> place_sum_;
  Eigen::VectorXd camera_solution_;
  double together_ = kTogether;   ///< tangents of a rim that are moved together
  double noise_scale_ = 0.0;      ///< of the stated sigmas; found in the first round
  double out_of_round_mm_ = 0.0;  ///< robust sigma of the tangents about the circles
};

}  // namespace

AxisCurve JointEstimate::axis() const {
  AxisCurve curve;
  curve.x_step_mm = step_mm;
  for (const NodeVector& node : nodes) {
    curve.yz_mm.emplace_back(node(kY), node(kZ));
    curve.slope.emplace_back(node(kYSlope), node(kZSlope));
  }
  return curve;
}

std::optional<JointEstimate> estimate_jointly(std::span<const ObservedForging> observations,
                                              std::vector<Placement> placements, const AxisCurve& start,
                                              std::span<const double> start_radius_mm, double shift_sigma_mm,
                                              const CombineConfig& config) {
  return JointSolver(observations, std::move(placements), start, start_radius_mm, shift_sigma_mm, config).run();
}

}  // namespace imprint
