#pragma once

#include <vector>

#include "lib/targets/target_library.h"
#include "node/detect/scan_ring.h"

namespace imprint {

/// The best code for a scanned ring and how sure it is.
struct DecodedRing {
  int id = 0;
  int wrong = 0;          ///< bits that show the other colour
  int unknown = 0;        ///< bits that show neither colour (a cover, dirt, outside the image)
  double distance = 0.0;  ///< wrong + unknown / 2, as [A] equation 14 counts
  double cost = 0.0;      ///< of the code's explanation of the ring, in nats (`RingExplanation`)
  double margin = 0.0;    ///< what the best explanation by another id costs more, in nats
  double lead = 0.0;      ///< by how much margin and cost are better than is asked of such a ring, in nats
  double covered = 0.0;   ///< share of the ring under covers
  double fit = 0.0;      ///< rms difference between the readings of known bits and the code's, in shares of their light
  double profile = 0.0;  ///< rms difference of the scan's columns to the code's blurred profile, noise taken out
  double step = 0.0;     ///< rms of the steps between inner and outer half of known bits, noise taken out
  std::uint32_t code = 0;  ///< the code at its rotation: bit (bits - 1) is the scan's first
  bool accepted = false;
};

/// Whether most white bits of `code` (its first bit where the scan's is) go on inside or outside of the ring, where a
/// target has its ground: discs beside a dot do.
bool is_open(const RingScan& scan, std::uint32_t code);

/// Decodes rings by maximum likelihood over all codes and rotations of a library, black, white and covered bits allowed
/// for (`RingEvidence`); [A] 2.3.6 to 2.3.8 with likelihoods in place of its similarity and probability.
class RingDecoder {
 public:
  RingDecoder(const TargetLibrary& library, double max_unknown);

  /// The most likely code, for the light as the dot's shading has it, or, when that is not accepted, for the light that
  /// fits the white bits of a first decoding. It is accepted when it explains the ring well, clearly better than any
  /// other id does (more clearly where part of the ring is covered), and when its bits reach across the ring.
  [[nodiscard]] DecodedRing decode(RingScan& scan) const;

  /// The code that the bits are when each is taken for white above the middle between black and white; accepted when
  /// it is in the library as read. No error is corrected, none is noticed.
  [[nodiscard]] DecodedRing decode_plainly(const RingScan& scan) const;

  /// Fewest white bits of a ring that could be accepted.
  [[nodiscard]] int least_white() const { return least_white_; }

 private:
  struct Match;
  [[nodiscard]] std::vector<Match> likeliest(const RingScan& scan) const;
  [[nodiscard]] DecodedRing decode_once(const RingScan& scan) const;
  static bool turn_to_fit(RingScan& scan, const DecodedRing& ring);
  [[nodiscard]] double least_margin(const DecodedRing& ring) const;
  void compare_profile(const RingScan& scan, DecodedRing& ring) const;
  void compare_bits(const RingScan& scan, DecodedRing& ring) const;

  int bits_;
  double max_unknown_;
  int min_distance_;
  int least_white_;
  std::vector<TargetCode> codes_;
};

}  // namespace imprint
