#pragma once

#include <functional>
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "lib/result/result.h"

namespace imprint {

/// The command line being built. A sub-command registers its options and, through `on`, what it runs;
/// `run` is called after parsing and gives the exit status (contract section 3).
struct Cli {
  CLI::App app{"Imprint measures hot forgings from their silhouettes", "imprint"};
  bool json = false;
  std::function<int()> run;

  /// A sub-command of `parent` that runs `action`; every one takes --json.
  CLI::App* command(CLI::App& parent, const std::string& name, const std::string& help, std::function<int()> action) {
    CLI::App* sub = parent.add_subcommand(name, help);
    sub->add_flag("--json", json, "one JSON document on stdout, nothing else there");
    sub->callback([this, action = std::move(action)] { run = action; });
    return sub;
  }
};

/// Prints "imprint: <message>" on stderr and gives the exit status of the error.
inline int fail(const Error& error) {
  std::cerr << "imprint: " << error.message << '\n';
  return error.exit_status();
}

inline int print_json(const nlohmann::json& document) {
  std::cout << document.dump(2) << '\n';
  return 0;
}

void add_targets_command(Cli& cli);
void add_resect_command(Cli& cli);
void add_calibrate_command(Cli& cli);
void add_survey_command(Cli& cli);
void add_field_command(Cli& cli);
void add_verify_command(Cli& cli);
void add_edges_command(Cli& cli);
void add_measure_command(Cli& cli);
void add_report_command(Cli& cli);
void add_compare_command(Cli& cli);
void add_straighten_command(Cli& cli);
void add_simulate_command(Cli& cli);
void add_live_commands(Cli& cli);    // status, watch, trigger
void add_remote_commands(Cli& cli);  // log, peek, config, bundle
void add_certs_command(Cli& cli);
void add_fleet_command(Cli& cli);
void add_users_command(Cli& cli);
void add_recording_commands(Cli& cli);  // record, replay

}  // namespace imprint
