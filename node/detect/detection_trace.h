#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "node/detect/decode_ring.h"
#include "node/detect/detect_targets.h"
#include "node/detect/ellipse.h"
#include "node/detect/scan_ring.h"

namespace imprint {

/// Why a bright ellipse was not taken for a coded target.
enum class Rejection { none, no_dark_ground, no_ring, poor_ellipse, size, outside, no_code, id_twice };

const char* name_of(Rejection rejection);

/// What a detection saw on its way: filled for a debug image, not needed otherwise.
struct DetectionTrace {
  struct Rejected {
    Ellipse ellipse;  // px of the image
    Rejection reason;
  };
  struct Decoded {
    FittedDot dot;
    RingScan scan;
    DecodedRing ring;
  };
  std::vector<Rejected> rejected;
  std::vector<Decoded> decoded;
};

/// As `detect_targets`, and notes in `trace` (which may be null) what was looked at and why it was left.
std::vector<DetectedTarget> detect_targets(const cv::Mat& image, const TargetLibrary& library,
                                           const DetectConfig& config, DetectionTrace* trace);

}  // namespace imprint
