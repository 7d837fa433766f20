#include "node/detect/ring_evidence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace imprint {
namespace {

constexpr double black_sigma = 0.08;  // unevenness of the ground, in units of the dot's contrast, ours
constexpr double white_sigma = 0.12;  // unevenness of paint and light, in shares of a white bit's reading, ours
constexpr double edge_sigma = 0.04;   // of a bit's border, in bits: what the dot's ellipse leaves open, ours
constexpr double cover_sigma = 0.10;  // unevenness of a cover, ours
// What is uneven is uneven over some length: a bit holds about one and a half independent readings of it.
constexpr double independent_per_bit = 1.5;
constexpr double lowest_grey = -0.5;  // of a cover, in units of the dot's contrast
constexpr double grey_step = 0.2;
// Negative logarithms of probabilities, ours: that a cover begins somewhere on the ring, that it has a given grey
// level, that it goes on for another bit, and how much less an even one of that level is surprising than any reading.
constexpr double cost_of_cover = 5.5;
constexpr double cost_of_grey = 2.5;
constexpr double cost_of_bit = 0.25;
constexpr double cost_of_unevenness = 2.3;
constexpr int most_covers = 2;

constexpr int columns_per_sample = columns_per_bit / RingEvidence::samples_per_bit;
constexpr double correlated = RingEvidence::samples_per_bit / independent_per_bit;

}  // namespace

RingEvidence::RingEvidence(const RingScan& scan)
    : bits_(static_cast<int>(scan.response.size())),
      samples_(bits_ * samples_per_bit),
      columns_(scan.columns),
      expected_(static_cast<std::size_t>(samples_)),
      clear_(static_cast<std::size_t>(samples_)) {
  constexpr double columns_of_reading = 16.0;  // the scan's noise is of a mean of so many
  noise_variance_ = scan.noise * scan.noise * columns_of_reading / columns_per_sample;
  for (auto& costs : cover_) costs.resize(static_cast<std::size_t>(samples_));
  for (int i = 0; i < samples_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const BitResponse& response = scan.response[at / samples_per_bit];
    const double offset = (i % samples_per_bit + 0.5) / samples_per_bit - 0.5;
    for (unsigned colours = 0; colours < 8; ++colours) {
      const auto expected_at = [&](double place) {
        return response.column_reading(place, static_cast<int>(colours >> 2U & 1U),
                                       static_cast<int>(colours >> 1U & 1U), static_cast<int>(colours & 1U));
      };
      const double expected = expected_at(offset);
      const double at_edge = 0.5 * (expected_at(offset + edge_sigma) - expected_at(offset - edge_sigma));
      const double uneven = std::hypot(black_sigma, white_sigma * expected, at_edge);
      expected_[at][colours] = {expected, correlated * uneven * uneven + noise_variance_};
    }
  }
  turn(0);
}

void RingEvidence::turn(int columns) {
  const int count = static_cast<int>(columns_.size());
  for (int i = 0; i < samples_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    double reading = 0.0;
    for (int k = 0; k < columns_per_sample; ++k) {
      const int column = (i * columns_per_sample + k + columns + count) % count;
      reading += columns_[static_cast<std::size_t>(column)] / columns_per_sample;
    }
    const bool outside = std::isnan(reading);  // whatever the code is, or what covers it
    for (std::size_t colours = 0; colours < 8; ++colours) {
      const double off = reading - expected_[at][colours].reading;
      clear_[at][colours] = outside ? 0.0 : 0.5 * (off * off - noise_variance_) / expected_[at][colours].variance;
    }
    for (std::size_t g = 0; g < greys; ++g) {
      const double off = reading - (lowest_grey + static_cast<double>(g) * grey_step);
      const double surprise =
          0.5 * (off * off - noise_variance_) / (correlated * cover_sigma * cover_sigma + noise_variance_);
      cover_[g][at] = cost_of_bit / samples_per_bit + (outside ? 0.0 : surprise);
    }
    cover_[greys][at] = (cost_of_bit + cost_of_unevenness * independent_per_bit) / samples_per_bit;
  }
}

RingEvidence::Stretch RingEvidence::best_cover(const std::vector<double>& clear) const {
  Stretch best;
  for (std::size_t g = 0; g < cover_.size(); ++g) {
    const double begin = cost_of_cover + (g < greys ? cost_of_grey : 0.0);
    // The stretch of the circle with the largest sum, from all that end at a sample the best.
    Stretch running;
    for (int i = 0; i < 2 * samples_; ++i) {
      const auto at = static_cast<std::size_t>(i % samples_);
      if (running.gain <= 0.0 || running.length >= samples_) running = {0.0, i, 0};
      running.gain += clear[at] - cover_[g][at];
      ++running.length;
      if (running.gain - begin > best.gain) best = {running.gain - begin, running.first % samples_, running.length};
    }
  }
  return best;
}

RingExplanation RingEvidence::explain(std::uint32_t code) const {
  RingExplanation explanation;
  std::vector<double> clear(static_cast<std::size_t>(samples_));
  for (int i = 0; i < samples_; ++i) {
    // Colours of three neighbours, the ring closed.
    const int bit = i / samples_per_bit;
    const auto colour = [&](int b) { return (code >> static_cast<unsigned>(bits_ - 1 - (b + bits_) % bits_)) & 1U; };
    const unsigned colours = colour(bit - 1) << 2U | colour(bit) << 1U | colour(bit + 1);
    clear[static_cast<std::size_t>(i)] = clear_[static_cast<std::size_t>(i)][colours];
    explanation.cost += clear[static_cast<std::size_t>(i)];
  }
  explanation.sample_covered.assign(static_cast<std::size_t>(samples_), false);
  int covered = 0;
  while (explanation.covers < most_covers && explanation.cost > cost_of_cover) {
    const Stretch cover = best_cover(clear);
    if (cover.gain <= 0.0) break;
    explanation.cost -= cover.gain;
    ++explanation.covers;
    for (int k = 0; k < cover.length; ++k) {
      const auto at = static_cast<std::size_t>((cover.first + k) % samples_);
      clear[at] = 0.0;
      if (!explanation.sample_covered[at]) ++covered;
      explanation.sample_covered[at] = true;
    }
  }
  explanation.covered = static_cast<double>(covered) / samples_;
  return explanation;
}

}  // namespace imprint
