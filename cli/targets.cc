#include "cli/command.h"

namespace imprint {

void add_targets_command(Cli& /*cli*/) {}

}  // namespace imprint
