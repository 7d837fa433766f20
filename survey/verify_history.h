#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// One row of a verification's history.
struct HistoryRow {
  std::string time_utc;  ///< ISO 8601, UTC
  std::string what;
  double nominal_mm = 0.0, measured_mm = 0.0, deviation_mm = 0.0, ci95_mm = 0.0, limit_mm = 0.0;
  std::string cameras;  ///< ids, separated by spaces
  bool pass = false;
};

/// Reads a history: header `time_utc,what,nominal_mm,measured_mm,deviation_mm,ci95_mm,limit_mm,cameras,result`. Names
/// the line of a row that does not read.
Result<std::vector<HistoryRow>> read_history(const std::filesystem::path& path);

/// Adds rows at the end; the file is made with its header if need be. Rows are added whole or not at all, also when
/// several programs do it at once: nothing that is there is ever rewritten. Fails (invalid_input) when the file is no
/// history or cannot be written.
Result<void> append_history(const std::filesystem::path& path, const std::vector<HistoryRow>& rows);

}  // namespace imprint
