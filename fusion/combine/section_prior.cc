#include "fusion/combine/section_prior.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

/// Shape of the spectrum while only its size can be learnt: sigma falls as 1/k.
double spectrum(int k) { return static_cast<double>(kFirstHarmonic) / k; }

constexpr double kLeastBend = 2e-4;

/// Precision of one step of an integrated random walk (value, slope) with unit density.
Eigen::Matrix2d bend_precision(double h) {
  Eigen::Matrix2d covariance;
  covariance << h * h * h / 3.0, h * h / 2.0, h * h / 2.0, h;
  return covariance.inverse();
}

/// Evidence of a variance: squared estimates (in its unit), how many there are, and how many of them the data leave
/// open. An open one says nothing of the variance; counting only the others converges in few rounds where plain
/// expectation maximisation creeps.
struct Amount {
  double squares = 0.0;
  double open = 0.0;
  double count = 0.0;
  [[nodiscard]] double variance() const { return squares / std::max(count - open, 0.01 * count); }
};

}  // namespace

SectionPrior::SectionPrior(std::vector<double> unseen_step_mm, double step_mm, double radius_mm,
                           double out_of_round_share, double out_of_round_length_mm)
    : step_mm_(step_mm),
      radius_mm_(radius_mm),
      length_mm_(step_mm * static_cast<double>(unseen_step_mm.size())),
      harmonic_length_mm_(out_of_round_length_mm),
      // A slope that changes by 0.02 over the length.
      bend_density_(4e-4 / length_mm_),
      // No opinion of the radius at first, so that shoulders show.
      radius_density_(0.01 * radius_mm * radius_mm / step_mm),
      unseen_step_mm_(std::move(unseen_step_mm)),
      radius_trust_(unseen_step_mm_.size(), 1.0) {
  for (int k = kFirstHarmonic; k <= kLastHarmonic; ++k)
    harmonic_sigma_mm_[static_cast<std::size_t>(k - kFirstHarmonic)] = out_of_round_share * radius_mm * spectrum(k);
}

void SectionPrior::add_to(BorderedSystem& system) const {
  const int n = system.nodes();
  const Eigen::Matrix2d bend = bend_precision(step_mm_) / bend_density_;
  Eigen::Matrix2d advance;
  advance << 1.0, step_mm_, 0.0, 1.0;
  const Eigen::Matrix2d bend_own = advance.transpose() * bend * advance;
  const Eigen::Matrix2d bend_cross = -advance.transpose() * bend;
  const double keep = std::exp(-step_mm_ / harmonic_length_mm_);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    NodeMatrix& own = system.diagonal[k];
    // So weak that it only keeps a stretch nobody sees from being singular.
    for (const int place : {kY, kZ, kRadius}) own(place, place) += 1e-8 / (radius_mm_ * radius_mm_);
    for (const int place : {kYSlope, kZSlope}) own(place, place) += 1e-8;
    for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order) {
      const double sigma = harmonic_sigma_mm(order);
      const double stationary = 1.0 / (sigma * sigma);
      const double fresh = stationary / (1.0 - keep * keep);
      for (const int place : {cosine_of(order), sine_of(order)}) {
        if (i == 0) own(place, place) += stationary;
        if (i > 0) own(place, place) += fresh;
        if (i + 1 < n) {
          own(place, place) += keep * keep * fresh;
          system.upper[k](place, place) -= keep * fresh;
        }
      }
    }
    if (i + 1 == n) continue;
    NodeMatrix& next = system.diagonal[k + 1];
    for (const int place : {kY, kZ}) {
      own.block<2, 2>(place, place) += bend_own;
      system.upper[k].block<2, 2>(place, place) += bend_cross;
      next.block<2, 2>(place, place) += bend;
    }
    const double learnt = radius_density_ * step_mm_ / radius_trust_[k];
    const double precision = 1.0 / std::max(learnt, unseen_step_mm_[k] * unseen_step_mm_[k]);
    own(kRadius, kRadius) += precision;
    next(kRadius, kRadius) += precision;
    system.upper[k](kRadius, kRadius) -= precision;
  }
}

void SectionPrior::learn(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                         std::span<const NodeMatrix> with_next, int observations, double out_of_round_mm) {
  learn_harmonics(nodes, own, observations, out_of_round_mm);
  learn_axis(nodes, own, with_next);
  learn_radius(nodes, own, with_next);
}

void SectionPrior::learn_harmonics(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own, int observations,
                                   double out_of_round_mm) {
  const std::size_t n = nodes.size();
  std::array<Amount, kHarmonics> amounts{};
  for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order) {
    const double variance = harmonic_sigma_mm(order) * harmonic_sigma_mm(order);
    Amount& amount = amounts[static_cast<std::size_t>(order - kFirstHarmonic)];
    for (const int place : {cosine_of(order), sine_of(order)}) {
      for (std::size_t i = 0; i < n; ++i) {
        const double value = nodes[i](place);
        amount.squares += value * value;
        amount.open += own[i](place, place) / variance;
        amount.count += 1.0;
      }
    }
  }
  Amount all;
  for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order) {
    const Amount& amount = amounts[static_cast<std::size_t>(order - kFirstHarmonic)];
    all.squares += amount.squares / (spectrum(order) * spectrum(order));
    all.open += amount.open;
    all.count += amount.count;
  }
  // The more observations, the more each harmonic speaks for itself.
  const double own_share = std::clamp((observations - 2) / 3.0, 0.0, 0.9);
  double shape = 0.0;
  for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order) shape += spectrum(order) * spectrum(order);
  // The axis and the mean of six tangents take some of their variance.
  const double most = 1.5 * out_of_round_mm * out_of_round_mm / shape;
  for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order) {
    const auto k = static_cast<std::size_t>(order - kFirstHarmonic);
    const double pooled = std::min(all.variance(), most) * spectrum(order) * spectrum(order);
    harmonic_sigma_mm_[k] =
        std::max(1e-5 * radius_mm_, std::sqrt(own_share * amounts[k].variance() + (1.0 - own_share) * pooled));
  }
  harmonic_length_mm_ = shape_length_mm(nodes);
}

double SectionPrior::shape_length_mm(std::span<const NodeVector> nodes) const {
  // Read where a good part of the likeness is lost: from one node to the next a smooth forging changes so little
  // that it would seem never to change.
  constexpr double kLikeness = 0.6;
  const std::size_t n = nodes.size();
  const double longest = 0.5 * length_mm_;
  for (std::size_t lag = 1; lag < n / 2; lag += 1 + lag / 4) {
    double together = 0.0;
    double alone = 0.0;
    for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order) {
      const double precision = 1.0 / (harmonic_sigma_mm(order) * harmonic_sigma_mm(order));
      for (const int place : {cosine_of(order), sine_of(order)}) {
        for (std::size_t i = 0; i + lag < n; ++i) {
          const double value = nodes[i](place);
          const double later = nodes[i + lag](place);
          together += value * later * precision;
          alone += 0.5 * (value * value + later * later) * precision;
        }
      }
    }
    const double likeness = together / std::max(alone, 1e-300);
    if (likeness < kLikeness)
      return std::clamp(-step_mm_ * static_cast<double>(lag) / std::log(std::max(likeness, 0.1)), 3.0 * step_mm_,
                        longest);
  }
  return longest;
}

void SectionPrior::learn_axis(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                              std::span<const NodeMatrix> with_next) {
  const Eigen::Matrix2d precision = bend_precision(step_mm_);
  Eigen::Matrix2d advance;
  advance << 1.0, step_mm_, 0.0, 1.0;
  Amount amount;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    for (const int place : {kY, kZ}) {
      const Eigen::Vector2d gain = nodes[i + 1].segment<2>(place) - advance * nodes[i].segment<2>(place);
      const Eigen::Matrix2d cross = with_next[i].block<2, 2>(place, place);
      const Eigen::Matrix2d spread = own[i + 1].block<2, 2>(place, place) +
                                     advance * own[i].block<2, 2>(place, place) * advance.transpose() -
                                     advance * cross - cross.transpose() * advance.transpose();
      amount.squares += gain.dot(precision * gain);
      amount.open += (precision * spread).trace() / bend_density_;
      amount.count += 2.0;
    }
  }
  // Between a rod straight to 1e-4 of its length and one bent by a fifth of it.
  bend_density_ = std::clamp(amount.variance(), kLeastBend / length_mm_, 0.04 / length_mm_);
}

void SectionPrior::learn_radius(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                                std::span<const NodeMatrix> with_next) {
  const std::size_t steps = nodes.size() - 1;
  std::vector<double> squared(steps);
  std::vector<double> spread(steps);
  for (std::size_t i = 0; i < steps; ++i) {
    const double gain = nodes[i + 1](kRadius) - nodes[i](kRadius);
    squared[i] = gain * gain;
    spread[i] = own[i](kRadius, kRadius) + own[i + 1](kRadius, kRadius) - 2.0 * with_next[i](kRadius, kRadius);
  }
  // Student's t with one degree of freedom: most steps small, a shoulder free.
  constexpr double kFreedom = 1.0;
  for (int round = 0; round < 3; ++round) {
    const double variance = radius_density_ * step_mm_;
    Amount amount;
    for (std::size_t i = 0; i < steps; ++i) {
      radius_trust_[i] = (kFreedom + 1.0) / (kFreedom + (squared[i] + spread[i]) / variance);
      amount.squares += radius_trust_[i] * squared[i];
      amount.open += radius_trust_[i] * std::min(spread[i] / variance, 1.0);
      amount.count += radius_trust_[i];
    }
    const double floor = 1e-8 * radius_mm_ * radius_mm_ / length_mm_;
    radius_density_ = std::max(floor, amount.variance() / step_mm_);
  }
}

}  // namespace imprint
