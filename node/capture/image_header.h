#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "lib/result/result.h"

namespace imprint {

/// What a picture's file says of itself before its pixels are decoded.
struct ImageHeader {
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
};

/// Reads the header of a PNG or TIFF and checks that the file holds all the bytes its structure promises (PNG: every
/// chunk to IEND; TIFF: every strip or tile of the first directory), since decoders may return half a picture from a
/// truncated file. `source` names the file in the errors.
Result<ImageHeader> check_image_bytes(std::string_view bytes, const std::string& source);

}  // namespace imprint
