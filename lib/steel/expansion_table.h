#pragma once

#include <string_view>

namespace imprint {

extern const std::string_view kExpansionTable;  ///< expansion.toml

}  // namespace imprint
