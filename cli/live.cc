#include "cli/command.h"

namespace imprint {

void add_live_commands(Cli& /*cli*/) {}

}  // namespace imprint
