#pragma once

#include <filesystem>

#include <SQLiteCpp/SQLiteCpp.h>

#include "lib/result/result.h"

namespace imprint {

/// The schema version of a database that this program can use; 0: an empty one. Fails (invalid_input) on a database of
/// another program or of a newer imprint-fusion.
Result<int> known_version(SQLite::Database& db, const std::filesystem::path& path);

/// Makes the tables, or brings those of any former version to today's with what they hold, in one transaction.
/// Fails as `known_version`.
Result<void> prepare_schema(SQLite::Database& db, const std::filesystem::path& path);

}  // namespace imprint
