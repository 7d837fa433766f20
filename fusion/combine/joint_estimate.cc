#include "fusion/combine/joint_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/combine/rod_surface.h"
#include "fusion/combine/tangent_rows.h"
#include "fusion/combine/unseen_steps.h"
#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr double kTogether = 3.0;               // tangents of a rim that haze and filtering move together, at least
constexpr double kLeastNoise = 0.2;             // of the stated sigma: exact input must not make the equations singular
constexpr double kLeastOutOfRound = 7e-3;       // of the radius: what a forging may be before it counts as a fault
constexpr std::size_t kEnoughObservations = 4;  // that the noise can be told from the sections' shapes
constexpr double kMedianOfSquare = 0.4549;      // of a squared normal value
constexpr double kFreedom = 4.0;                // of Student's t for the tangents
constexpr double kMostFollowed = 0.8;           // of the noise by the fit, beyond which the rest says too little
constexpr double kStartShare = 0.05;            // sigma of the start's radius, of the radius
constexpr double kPlaceShare = 0.02;            // variance of a station's place along x, in squared steps between nodes

class JointSolver {
 public:
  JointSolver(std::span<const ObservedForging> observations, std::vector<Placement> placements, const AxisCurve& start,
              std::span<const double> start_radius_mm, double shift_sigma_mm, const CombineConfig& config)
      : config_(config),
        step_mm_(start.x_step_mm),
        length_mm_(start.x_step_mm * static_cast<double>(start.yz_mm.size() - 1)),
        radius_mm_(median({start_radius_mm.begin(), start_radius_mm.end()})),
        end_margin_mm_(end_margin_mm(step_mm_, shift_sigma_mm, radius_mm_)),
        prior_(unseen_steps(observations, start_radius_mm, start.x_step_mm), start.x_step_mm, radius_mm_,
               config.out_of_round_share, config.out_of_round_length_share * length_mm_),
        tangents_(tangent_rows(observations)),
        places_(tangents_.viewers, std::move(placements), length_mm_, radius_mm_, shift_sigma_mm, config),
        system_(static_cast<int>(start.yz_mm.size()), places_.unknowns()) {
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
    std::vector<double> out_of_round;
    for (const ObservedForging& observed : observations) out_of_round.push_back(observed.out_of_round_mm);
    out_of_round_mm_ = std::max(median(out_of_round), kLeastOutOfRound * radius_mm_);
  }

  std::optional<JointEstimate> run() {
    for (int iteration = 0; iteration < config_.iterations; ++iteration)
      if (!improve(iteration)) return std::nullopt;
    together_ = std::max(kTogether, moved_together(tangents_, noise_scale_));
    std::vector<std::optional<TangentEquation>> equations;
    if (!solve(Use::interval, equations)) return std::nullopt;
    JointEstimate estimate;
    estimate.step_mm = step_mm_;
    estimate.nodes = nodes_;
    estimate.covariance = std::move(own_);
    system_.add_border_covariance(estimate.covariance);
    estimate.placements = places_.placements();
    estimate.scatter_share = noise_scale_;
    estimate.shift_sigma_mm = places_.shift_sigma_mm(system_.border_covariance());
    estimate.system = std::move(system_);
    return estimate;
  }

 private:
  enum class Use { estimate, held, interval };

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
    system_.clear();
    prior_.add_to(system_);
    if (use != Use::interval) add_start();
    places_.add_priors({nodes_.front()(kY), nodes_.front()(kZ)}, {nodes_.back()(kY), nodes_.back()(kZ)}, system_.corner,
                       system_.border_right);
    const RodSurface rod(nodes_, step_mm_);
    equations.clear();
    equations.reserve(tangents_.rows.size());
    for (TangentRow& row : tangents_.rows) {
      equations.push_back(equation_of(row, places_, rod, length_mm_, end_margin_mm_));
      if (equations.back()) equations.back()->extra_variance_mm2 = shoulder_variance_mm2(*equations.back());
    }
    if (!(noise_scale_ > 0.0)) noise_scale_ = std::max(kLeastNoise, first_scatter(equations));
    const bool held = use == Use::held;
    for (std::size_t r = 0; r < equations.size(); ++r)
      if (equations[r]) add_equation(tangents_.rows[r], *equations[r], held);
    if (!(held ? system_.solve_nodes(places_.held()) : system_.solve())) return false;
    system_.node_covariances(own_, with_next_);
    return true;
  }

  bool improve(int round) {
    // Places settle at once and are the costly part: most rounds leave them where they are.
    constexpr int kPlacesEvery = 4;
    const bool last = round + 1 == config_.iterations;
    std::vector<std::optional<TangentEquation>> equations;
    if (!solve(round % kPlacesEvery != 0 ? Use::held : Use::estimate, equations)) return false;
    nodes_ = system_.node_solution;
    find_residuals(equations);
    places_.take(system_.border_solution);
    // The last round leaves amounts and solution belonging to each other.
    if (last) return true;
    if (round > 0) together_ = std::max(kTogether, moved_together(tangents_, noise_scale_));
    weigh(equations);
    prior_.learn(nodes_, own_, with_next_, static_cast<int>(places_.placements().size()), out_of_round_mm_);
    return true;
  }

  double first_scatter(std::span<const std::optional<TangentEquation>> equations) const {
    std::vector<std::optional<double>> off;
    for (const auto& e : equations)
      off.push_back(e ? std::optional(e->value_mm - e->coefficients.dot((1.0 - e->share) * start_[e->node] +
                                                                        e->share * start_[e->node + 1]))
                      : std::nullopt);
    return rim_scatter(tangents_, off);
  }

  void add_equation(const TangentRow& row, const TangentEquation& equation, bool held) {
    const double w =
        row.trust / (row.variance_mm2 * noise_scale_ * noise_scale_ * together_ + equation.extra_variance_mm2);
    if (held)
      places_.add_held(system_, equation.coefficients, equation, row.viewer, w);
    else
      places_.add(system_, equation.coefficients, equation, row.viewer, w);
  }

  void find_residuals(std::span<const std::optional<TangentEquation>> equations) {
    for (std::size_t r = 0; r < tangents_.rows.size(); ++r) {
      TangentRow& row = tangents_.rows[r];
      row.used = equations[r].has_value();
      if (!row.used) continue;
      const TangentEquation& equation = *equations[r];
      const NodeVector node =
          (1.0 - equation.share) * nodes_[equation.node] + equation.share * nodes_[equation.node + 1];
      row.residual_mm = equation.value_mm - equation.coefficients.dot(node) -
                        places_.made_by_places(equation, row.viewer, system_.border_solution);
      row.from_circle_mm =
          row.residual_mm + equation.coefficients.tail<2 * kHarmonics>().dot(node.tail<2 * kHarmonics>());
    }
  }

  /// What lies far out of what the rod is out of round belongs to something else (Tukey's biweight). Next to a step
  /// any radius from the one to the other is on the rod. Of several observations none is silenced for contradicting
  /// the others: one that was turned wrongly has to show.
  double belongs(const TangentRow& row, const TangentEquation& equation) const {
    if (places_.placements().size() > 1) return 1.0;
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
    std::vector<double> squares;  // of the deviations, in the stated variances
    double followed = 0.0;        // of the noise, by the fit: what its freedom takes from those squares
    for (std::size_t r = 0; r < tangents_.rows.size(); ++r) {
      TangentRow& row = tangents_.rows[r];
      if (!row.used) continue;
      const TangentEquation& e = *equations[r];
      const NodeVector& g = e.coefficients;
      const double here = 1.0 - e.share;
      // Lazily: a product of this size is not worth the preparations for a large one.
      const auto spread = [&g](const NodeMatrix& covariance) { return g.dot(covariance.lazyProduct(g)); };
      const double fitted = here * here * spread(own_[e.node]) + e.share * e.share * spread(own_[e.node + 1]) +
                            2.0 * here * e.share * spread(with_next_[e.node]);
      const double expected = row.residual_mm * row.residual_mm + fitted;
      squares.push_back(row.residual_mm * row.residual_mm / row.variance_mm2);
      const double noise = row.variance_mm2 * noise_scale_ * noise_scale_;
      const double variance = noise + e.extra_variance_mm2;
      followed += std::min(fitted / noise, 1.0);
      row.trust = (kFreedom + 1.0) / (kFreedom + expected / variance) * belongs(row, e);
    }
    // Of few observations the sections' shapes can follow any noise: then what the rims scatter at first has to do.
    if (places_.placements().size() >= kEnoughObservations && !squares.empty()) {
      const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
      std::nth_element(squares.begin(), middle, squares.end());
      const double left = 1.0 - std::min(followed / static_cast<double>(squares.size()), kMostFollowed);
      noise_scale_ = std::clamp(std::sqrt(*middle / kMedianOfSquare / left), kLeastNoise, noise_scale_);
    }
  }

  CombineConfig config_;
  double step_mm_;
  double length_mm_;
  double radius_mm_;
  double end_margin_mm_;
  SectionPrior prior_;
  TangentRows tangents_;
  ViewerPlaces places_;
  BorderedSystem system_;
  std::vector<NodeVector> nodes_, start_;
  std::vector<NodeMatrix> own_, with_next_;
  std::vector<std::pair<double, double>> radius_range_;  ///< about each node, of the start
  double together_ = kTogether;                          ///< tangents of a rim that are moved together
  double noise_scale_ = 0.0;                             ///< of the stated sigmas; found in the first round
  double out_of_round_mm_ = 0.0;                         ///< robust sigma of the tangents about the circles
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
