#include "cli/command.h"

int main(int argc, char** argv) {
  imprint::Cli cli;
  cli.app.require_subcommand(1);
  cli.app.set_version_flag("--version", IMPRINT_VERSION);
  imprint::add_targets_command(cli);
  imprint::add_resect_command(cli);
  imprint::add_calibrate_command(cli);
  imprint::add_survey_command(cli);
  imprint::add_field_command(cli);
  imprint::add_verify_command(cli);
  imprint::add_edges_command(cli);
  imprint::add_measure_command(cli);
  imprint::add_report_command(cli);
  imprint::add_simulate_command(cli);
  imprint::add_live_commands(cli);
  try {
    cli.app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return cli.app.exit(error) == 0 ? 0 : 2;
  }
  try {
    return cli.run();
  } catch (const std::exception& error) {  // a fault of ours or of a library: still one line, never a crash
    std::cerr << "imprint: unexpected: " << error.what() << '\n';
    return 1;
  }
}
