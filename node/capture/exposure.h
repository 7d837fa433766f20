#pragma once

#include "lib/result/result.h"

namespace imprint {

/// How a frame is, or is to be, exposed.
struct Exposure {
  double time_us = 0.0;  ///< 0: not known
  double gain_db = 0.0;  ///< 20 log10 of the amplification
};

/// What a camera offers whose exposure can be set.
class AdjustableExposure {
 public:
  virtual ~AdjustableExposure() = default;
  [[nodiscard]] virtual Exposure exposure() const = 0;
  /// Holds from the next frame on. Fails (job_failed) naming the camera where it does not take it.
  virtual Result<void> set_exposure(const Exposure& exposure) = 0;
};

}  // namespace imprint
