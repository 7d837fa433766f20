#pragma once

#include "cli/command.h"

namespace imprint {

/// `imprint targets sheet`.
void add_targets_sheet(Cli& cli, CLI::App& targets);

}  // namespace imprint
