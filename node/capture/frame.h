#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "node/capture/exposure.h"

namespace imprint {

/// One picture of one camera: one channel, 8 or 16 bit.
struct Frame {
  cv::Mat image;
  std::string source;  ///< file or device, for messages
  std::int64_t sensor_time_ns = 0;
  std::uint64_t sequence = 0;
  std::vector<std::string> warnings{};  ///< what the capture noticed, for the imprint
  Exposure exposure{};                  ///< it was taken with, where the source knows
};

}  // namespace imprint
