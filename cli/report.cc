#include "cli/command.h"

namespace imprint {

void add_report_command(Cli& /*cli*/) {}

}  // namespace imprint
