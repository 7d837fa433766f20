#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "firmware_config/board_config.h"
#include "lib/result/result.h"

namespace imprint {

/// Where a board keeps what makes it this camera: board.toml, identity/, rig/ and what the node has to keep.
inline constexpr const char* kBoardFolder = "/data/board";
inline constexpr const char* kNodeDataFolder = "/data/imprint";

/// Every file a board's config stands for, by its path on the board without the leading slash. Those below run/ are
/// made anew at each start, for a board's root is read-only; those below boot/ are written when the board is made.
/// Depends on nothing but the config.
std::map<std::filesystem::path, std::string> board_files(const BoardConfig& config);

/// Writes them below `root`, whole or not at all each; `part`: only those below that folder (run, boot), empty: all.
Result<void> write_board_files(const BoardConfig& config, const std::filesystem::path& root, const std::string& part);

}  // namespace imprint
