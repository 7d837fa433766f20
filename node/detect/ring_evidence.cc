#include "node/detect/ring_evidence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

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
      clear_(static_cast<std::size_t>(samples_)),
      cover_(static_cast<std::size_t>(samples_)) {
  constexpr double columns_of_reading = 16.0;  // the scan's noise is of a mean of so many
  noise_variance_ = scan.noise * scan.noise * columns_of_reading / columns_per_sample;
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
      cover_[at][g] = static_cast<float>(cost_of_bit / samples_per_bit + (outside ? 0.0 : surprise));
    }
    cover_[at][greys] = static_cast<float>((cost_of_bit + cost_of_unevenness * independent_per_bit) / samples_per_bit);
    for (std::size_t g = greys + 1; g < groups * lanes; ++g) cover_[at][g] = 1e6F;  // no level
  }
}

RingEvidence::Stretch RingEvidence::best_cover(const std::vector<float>& clear) const {
  // Reading a ring takes longest for this: four grey levels at once in the lanes of a vector register.
  using Lanes = float __attribute__((vector_size(lanes * sizeof(float))));
  using Places = std::int32_t __attribute__((vector_size(lanes * sizeof(std::int32_t))));
  Stretch likeliest;
  for (std::size_t group = 0; group < groups; ++group) {
    // The stretch of the circle with the largest sum, from all that end at a sample the best.
    Lanes running{};
    Lanes best{};
    Places first{};
    Places best_first{};
    Places best_length{};
    for (std::int32_t i = 0; i < 2 * samples_; ++i) {
      const auto at = static_cast<std::size_t>(i < samples_ ? i : i - samples_);
      Lanes cover;
      std::memcpy(&cover, &cover_[at][group * lanes], sizeof(cover));
      const Places anew = (running <= 0.0F) | (i - first >= samples_);
      first = anew ? Places{} + i : first;
      running = (anew ? Lanes{} : running) + (clear[at] - cover);
      const Places better = running > best;
      best = better ? running : best;
      best_first = better ? first : best_first;
      best_length = better ? i - first + 1 : best_length;
    }
    for (std::size_t k = 0; k < lanes && group * lanes + k <= greys; ++k) {
      const float gain = best[k] - static_cast<float>(cost_of_cover + (group * lanes + k < greys ? cost_of_grey : 0.0));
      if (gain > likeliest.gain) likeliest = {gain, best_first[k] % samples_, best_length[k]};
    }
  }
  return likeliest;
}

RingExplanation RingEvidence::explain(std::uint32_t code) const {
  RingExplanation explanation;
  std::vector<float> clear(static_cast<std::size_t>(samples_));
  for (int i = 0; i < samples_; ++i) {
    // Colours of three neighbours, the ring closed.
    const int bit = i / samples_per_bit;
    const auto colour = [&](int b) { return (code >> static_cast<unsigned>(bits_ - 1 - (b + bits_) % bits_)) & 1U; };
    const unsigned colours = colour(bit - 1) << 2U | colour(bit) << 1U | colour(bit + 1);
    const double cost = clear_[static_cast<std::size_t>(i)][colours];
    clear[static_cast<std::size_t>(i)] = static_cast<float>(cost);
    explanation.cost += cost;
  }
  explanation.sample_covered.assign(static_cast<std::size_t>(samples_), false);
  int covered = 0;
  while (explanation.covers < most_covers && explanation.cost > cost_of_cover) {
    const Stretch cover = best_cover(clear);
    if (cover.gain <= 0.0F) break;
    explanation.cost -= cover.gain;
    ++explanation.covers;
    for (int k = 0; k < cover.length; ++k) {
      const auto at = static_cast<std::size_t>((cover.first + k) % samples_);
      clear[at] = 0.0F;
      if (!explanation.sample_covered[at]) ++covered;
      explanation.sample_covered[at] = true;
    }
  }
  explanation.covered = static_cast<double>(covered) / samples_;
  return explanation;
}

}  // namespace imprint
