#include "cli/command.h"

namespace imprint {

void add_measure_command(Cli& /*cli*/) {}

}  // namespace imprint
