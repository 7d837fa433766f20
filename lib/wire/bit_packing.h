#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// "Packing 1" of proto/imprint.proto: predicted, folded and Exp-Golomb coded in blocks of 25.
/// Cheap for values that run smoothly, and never much dearer than plain bits for values that do not.
/// Values and base within +-2^28.
std::string pack_values(std::span<const std::int32_t> values, std::int32_t base);

/// The `count` values back. Fails (invalid_input) when the bytes end too soon or a value leaves +-2^31.
Result<std::vector<std::int32_t>> unpack_values(std::string_view bytes, std::size_t count, std::int32_t base);

}  // namespace imprint
