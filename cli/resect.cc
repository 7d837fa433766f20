#include "cli/command.h"

namespace imprint {

void add_resect_command(Cli& /*cli*/) {}

}  // namespace imprint
