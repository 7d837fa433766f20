#pragma once

#include "imprint.pb.h"
#include "lib/imprint/imprint.h"
#include "lib/result/result.h"

namespace imprint {

/// How much of a curve is carried. Offsets are true to half a step.
struct CurveEconomy {
  double offset_step_px = 1.0 / 256.0;  ///< exact in binary; half of it is below the contract's 0.002 px
  int weight_levels = 255;
  bool interpolate_untrusted = false;  ///< offsets of weight 0 are replaced by the line between their neighbours
};

/// The n-th economy, n = 0 carrying most: first the untrusted offsets go, then the weights become coarser,
/// and only then, for curves too rough for any of that, does the offsets' step double with every n.
CurveEconomy curve_economy(int n);

/// An offset beyond this is no point of an image; it is not carried and its weight becomes 0.
inline constexpr double kMaxOffsetPx = 100000.0;

v1::Curve pack_curve(const ImprintCurve& curve, const CurveEconomy& economy);

/// Fails (invalid_input) on more than kImprintStations stations, an unknown packing or impossible values.
Result<ImprintCurve> unpack_curve(const v1::Curve& packed);

}  // namespace imprint
