#pragma once

#include <cstddef>

#include "node/imprint/rim_curve.h"

namespace imprint {

/// Takes the trust from trusted stretches of fewer than `least_run` stations among untrusted ones: they are there by
/// chance.
void drop_short_runs(RimCurve& curve, std::size_t least_run);

/// Takes the trust from short stretches that stand alone and are the inner border of scale rather than the rim: those
/// that lean across the axis, and those further in than the trusted stretches on both sides. `inward`: 1 where larger
/// offsets lie further in, else -1. What is taken from `filtered` is also taken from the samples `rim` it was made of.
void drop_islands(RimCurve& filtered, double inward, RimCurve& rim);

}  // namespace imprint
