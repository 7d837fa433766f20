#pragma once

#include <filesystem>
#include <string>

namespace imprint {

/// The common name of `cert.pem` in an identity's folder, for the log; a word that says so where it cannot be read.
std::string certificate_name(const std::filesystem::path& identity);

}  // namespace imprint
