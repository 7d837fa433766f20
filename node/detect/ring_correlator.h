#pragma once

#include <vector>

#include "node/detect/decode_ring.h"

namespace imprint {

/// For rings so blurred that dot and blur cannot be told apart, nor the bits' borders be seen: the code whose blurred
/// profile, at any turn, correlates best with the scan's columns.
class RingCorrelator {
 public:
  explicit RingCorrelator(const TargetLibrary& library);

  /// `turn`: columns from the scan's first to the code's first.
  struct Correlated {
    DecodedRing ring;
    int turn = 0;
    double light = 1.0;  ///< of white bits against black ones, in units of the dot's
  };

  /// Accepted when little is left unexplained and clearly more by any other id.
  [[nodiscard]] Correlated correlate(const RingScan& scan) const;

 private:
  struct Profile {
    std::size_t code;             // index
    std::vector<double> columns;  // mean 0, norm 1
    double light;                 // what its norm is before
  };
  std::vector<TargetCode> codes_;
  std::vector<Profile> profiles_;
};

}  // namespace imprint
