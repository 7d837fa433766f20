#include "fusion/combine/section_prior.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

/// Shape of the spectrum while only its size can be learnt: sigma falls as 1/k.
double spectrum(int k) { return static_cast<double>(kFirstHarmonic) / k; }

/// Precision of one step of an integrated random walk (value, slope) with unit density.
Eigen::Matrix2d bend_precision(double h) {
  Eigen::Matrix2d covariance;
  covariance << h * h * h / 3.0, h * h / 2.0, h * h / 2.0, h;
  return covariance.inverse();
}

}  // namespace

SectionPrior::SectionPrior(int nodes, double step_mm, double radius_mm, double out_of_round_share, double out_of_round_length_mm)
    : step_mm_(step_mm),
      radius_mm_(radius_mm),
      length_mm_(step_mm * (nodes - 1)),
      harmonic_length_mm_(out_of_round_length_mm),
      // A slope that changes by 0.02 over the length.
      bend_density_(4e-4 / length_mm_),
      // No opinion of the radius at first, so that shoulders show.
      radius_density_(0.01 * radius_mm * radius_mm / step_mm),
      radius_trust_(static_cast<std::size_t>(nodes - 1), 1.0) {
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
    const double precision = radius_trust_[k] / (radius_density_ * step_mm_);
    own(kRadius, kRadius) += precision;
    next(kRadius, kRadius) += precision;
    system.upper[k](kRadius, kRadius) -= precision;
  }
}

void SectionPrior::learn(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                         std::span<const NodeMatrix> with_next, int observations) {
  learn_harmonics(nodes, own, with_next, observations);
  learn_axis(nodes, own, with_next);
  learn_radius(nodes, own, with_next);
}

void SectionPrior::learn_harmonics(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                                   std::span<const NodeMatrix> with_next, int observations) {
  std::array<double, kHarmonics> power{};
  double relative = 0.0;
  double together = 0.0;
  for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order) {
    const double sigma = harmonic_sigma_mm(order);
    double sum = 0.0;
    for (const int place : {cosine_of(order), sine_of(order)}) {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const double squared = nodes[i](place) * nodes[i](place) + own[i](place, place);
        sum += squared;
        if (i + 1 == nodes.size()) continue;
        together += (nodes[i](place) * nodes[i + 1](place) + with_next[i](place, place)) / (sigma * sigma);
        relative += 0.5 * (squared + nodes[i + 1](place) * nodes[i + 1](place) + own[i + 1](place, place)) / (sigma * sigma);
      }
    }
    power[static_cast<std::size_t>(order - kFirstHarmonic)] = sum / (2.0 * static_cast<double>(nodes.size()));
  }
  double size2 = 0.0;
  for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order)
    size2 += power[static_cast<std::size_t>(order - kFirstHarmonic)] / (spectrum(order) * spectrum(order)) / kHarmonics;
  // The more observations, the more each harmonic speaks for itself.
  const double own_share = std::clamp((observations - 2) / 3.0, 0.0, 0.9);
  for (int order = kFirstHarmonic; order <= kLastHarmonic; ++order) {
    const auto k = static_cast<std::size_t>(order - kFirstHarmonic);
    const double pooled = size2 * spectrum(order) * spectrum(order);
    harmonic_sigma_mm_[k] = std::max(1e-5 * radius_mm_, std::sqrt(own_share * power[k] + (1.0 - own_share) * pooled));
  }
  const double keep = std::clamp(together / std::max(relative, 1e-300), std::exp(-step_mm_ / (2.0 * step_mm_)),
                                 std::exp(-step_mm_ / (2.0 * length_mm_)));
  harmonic_length_mm_ = -step_mm_ / std::log(keep);
}

void SectionPrior::learn_axis(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                              std::span<const NodeMatrix> with_next) {
  const Eigen::Matrix2d precision = bend_precision(step_mm_);
  Eigen::Matrix2d advance;
  advance << 1.0, step_mm_, 0.0, 1.0;
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    for (const int place : {kY, kZ}) {
      const Eigen::Vector2d gain = nodes[i + 1].segment<2>(place) - advance * nodes[i].segment<2>(place);
      const Eigen::Matrix2d cross = with_next[i].block<2, 2>(place, place);
      const Eigen::Matrix2d spread = gain * gain.transpose() + own[i + 1].block<2, 2>(place, place) +
                                     advance * own[i].block<2, 2>(place, place) * advance.transpose() - advance * cross -
                                     cross.transpose() * advance.transpose();
      sum += (precision * spread).trace();
    }
  }
  const double learnt = sum / (4.0 * static_cast<double>(nodes.size() - 1));
  // Between a rod straight to 1e-4 of its length and one bent by a fifth of it.
  bend_density_ = std::clamp(learnt, 1e-8 / length_mm_, 0.04 / length_mm_);
}

void SectionPrior::learn_radius(std::span<const NodeVector> nodes, std::span<const NodeMatrix> own,
                                std::span<const NodeMatrix> with_next) {
  // Student's t with one degree of freedom: most steps small, a shoulder free.
  constexpr double kFreedom = 1.0;
  const std::size_t steps = nodes.size() - 1;
  std::vector<double> squared(steps);
  for (std::size_t i = 0; i < steps; ++i) {
    const double gain = nodes[i + 1](kRadius) - nodes[i](kRadius);
    squared[i] = gain * gain + own[i](kRadius, kRadius) + own[i + 1](kRadius, kRadius) - 2.0 * with_next[i](kRadius, kRadius);
  }
  for (int round = 0; round < 3; ++round) {
    const double variance = radius_density_ * step_mm_;
    double sum = 0.0;
    for (std::size_t i = 0; i < steps; ++i) {
      radius_trust_[i] = (kFreedom + 1.0) / (kFreedom + squared[i] / variance);
      sum += radius_trust_[i] * squared[i];
    }
    const double floor = 1e-8 * radius_mm_ * radius_mm_ / length_mm_;
    radius_density_ = std::max(floor, sum / static_cast<double>(steps) / step_mm_);
  }
}

}  // namespace imprint
