#pragma once

#include <array>
#include <span>
#include <vector>

#include "fusion/combine/bordered_system.h"

namespace imprint {

// Places of a node's unknowns.
inline constexpr int kY = 0;
inline constexpr int kYSlope = 1;
inline constexpr int kZ = 2;
inline constexpr int kZSlope = 3;
inline constexpr int kRadius = 4;
inline constexpr int kFirstHarmonic = 2;
inline constexpr int kLastHarmonic = 6;
inline constexpr int kHarmonics = kLastHarmonic - kFirstHarmonic + 1;
constexpr int cosine_of(int k) { return 5 + 2 * (k - kFirstHarmonic); }
constexpr int sine_of(int k) { return cosine_of(k) + 1; }

/// What is known of a forging before it is seen: its axis bends smoothly (an integrated random walk of the slope),
/// its radius wanders with steps here and there (a random walk with heavy tails), its out-of-round harmonics keep
/// their shape over a stretch (a stationary process). The amounts are learnt from the tangents themselves.
class SectionPrior {
 public:
  /// `unseen_step_mm`: how far the radius steps from each node to the next where no tangent shows it; it stays free to.
  SectionPrior(std::vector<double> unseen_step_mm, double step_mm, double radius_mm, double out_of_round_share,
               double out_of_round_length_mm);

  void add_to(BorderedSystem& system) const;

  /// Learns the amounts from estimates and their covariances (expectation maximisation). `observations` says how far
  /// the harmonics can be told apart: below three, their spectrum keeps its shape and only its size is learnt.
  /// `out_of_round_mm`: robust sigma of the tangents about the sections' circles, which bounds what is learnt.
  void learn(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own, std::span<const NodeMatrix> with_next,
             int observations, double out_of_round_mm);

  [[nodiscard]] double harmonic_sigma_mm(int k) const {
    return harmonic_sigma_mm_[static_cast<std::size_t>(k - kFirstHarmonic)];
  }
  [[nodiscard]] double harmonic_length_mm() const { return harmonic_length_mm_; }
  [[nodiscard]] double bend_density() const { return bend_density_; }
  [[nodiscard]] double radius_density() const { return radius_density_; }

 private:
  void learn_harmonics(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own, int observations,
                       double out_of_round_mm);
  [[nodiscard]] double shape_length_mm(std::span<const NodeVector> nodes) const;
  void learn_axis(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                  std::span<const NodeMatrix> with_next);
  void learn_radius(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                    std::span<const NodeMatrix> with_next);

  double step_mm_;
  double radius_mm_;
  double length_mm_;
  std::array<double, kHarmonics> harmonic_sigma_mm_{};
  double harmonic_length_mm_;
  double bend_density_;    ///< variance of the slope gained per mm
  double radius_density_;  ///< mm^2 of variance of the radius per mm
  std::vector<double> unseen_step_mm_;
  std::vector<double> radius_trust_;  ///< of each step between nodes: near 0 at a shoulder
};

}  // namespace imprint
