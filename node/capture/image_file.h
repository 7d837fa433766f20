#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lib/result/result.h"
#include "node/capture/frame.h"

namespace imprint {

/// The picture in a PNG or TIFF file: one channel, 8 or 16 bit, as stored. A colour picture is reduced to its red
/// channel and a line is added to `warnings` (which may be null). Fails, naming the file, when it is missing, empty,
/// truncated, neither PNG nor TIFF, of another pixel type, of size zero or above `max_image_pixels`.
Result<Frame> read_image(const std::filesystem::path& path, std::vector<std::string>* warnings);

/// The largest picture that is read: four times the largest machine-vision sensors of today, so that a damaged
/// header cannot make us ask for all memory.
inline constexpr std::int64_t max_image_pixels = 600'000'000;

}  // namespace imprint
