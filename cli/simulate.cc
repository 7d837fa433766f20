#include "cli/command.h"

namespace imprint {

void add_simulate_command(Cli& /*cli*/) {}

}  // namespace imprint
