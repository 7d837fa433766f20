#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace imprint {

/// The status document (`imprint.status/1`) in Prometheus' text format: every counter, and of every camera what its
/// health, delivery and clock say. Nothing is given for what is not known.
std::string prometheus_text(const nlohmann::json& status);

}  // namespace imprint
