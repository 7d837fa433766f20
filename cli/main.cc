#include "cli/command.h"
#include "cli/command_line.h"

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
  imprint::add_compare_command(cli);
  imprint::add_straighten_command(cli);
  imprint::add_simulate_command(cli);
  imprint::add_live_commands(cli);
  imprint::add_recording_commands(cli);
  imprint::add_remote_commands(cli);
  imprint::add_certs_command(cli);
  imprint::add_fleet_command(cli);
  imprint::add_users_command(cli);
  if (const auto status = imprint::parse_command_line(cli.app, argc, argv)) return *status;
  try {
    return cli.run();
  } catch (const std::exception& error) {  // a fault of ours or of a library: still one line, never a crash
    std::cerr << "imprint: unexpected: " << error.what() << '\n';
    return 1;
  }
}
