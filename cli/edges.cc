#include "cli/command.h"

namespace imprint {

void add_edges_command(Cli& /*cli*/) {}

}  // namespace imprint
