#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "node/detect/scan_ring.h"

namespace imprint {

/// How well a code explains a scanned ring when things may cover parts of it.
struct RingExplanation {
  double cost = 0.0;     ///< negative log likelihood, in nats above that of a ring that shows the code to perfection
  int covers = 0;        ///< things that hide a stretch of the ring
  double covered = 0.0;  ///< share of the ring under covers
  std::vector<bool> sample_covered;  ///< each sample (`RingEvidence::samples_per_bit` to a bit)
};

/// The likelihood of codes given a scanned ring. The ring is a row of samples; each is normal about what the code
/// predicts there, with its neighbours' blur. A cover (dirt, a cable, a splash) is one stretch of one grey level, or of
/// none: it costs its improbability once and little more for each bit that it hides, so that neighbouring bits that are
/// amiss together tell less against a code than as many bits strewn over the ring, and so does an edge where the code
/// has none.
class RingEvidence {
 public:
  static constexpr int samples_per_bit = 6;

  explicit RingEvidence(const RingScan& scan);

  /// Takes the first bit to begin some columns (fewer than a bit has) later than in the scan; without a call, none.
  void turn(int columns);

  /// `code`: its first bit (bit `bits` - 1) where the scan's first is.
  [[nodiscard]] RingExplanation explain(std::uint32_t code) const;

 private:
  static constexpr int greys = 12;
  static constexpr std::size_t lanes = 4;
  static constexpr std::size_t groups = 4;  // of lanes: they hold all grey levels, and one for any

  struct Stretch {
    float gain = 0.0F;
    int first = 0;
    int length = 0;
  };
  [[nodiscard]] Stretch best_cover(const std::vector<float>& clear) const;

  struct Expected {
    double reading = 0.0;
    double variance = 0.0;
  };
  int bits_;
  int samples_;
  double noise_variance_ = 0.0;
  std::vector<double> columns_;
  std::vector<std::array<Expected, 8>> expected_;  // by sample and the colours of the bit before, the own and the next
  std::vector<std::array<double, 8>> clear_;       // the same
  std::vector<std::array<float, groups * lanes>> cover_;  // by sample and grey level (the one after the last: any)
};

}  // namespace imprint
