#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace imprint {

/// `nominal` of a result (fusion/acceptance) for a person, one sentence a line; nothing when the result has none or
/// another program wrote something else there.
std::vector<std::string> acceptance_lines(const nlohmann::json& result);

}  // namespace imprint
