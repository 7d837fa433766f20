#include <filesystem>
#include <optional>

#include "cli/command.h"
#include "cli/result_table.h"
#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

struct ReportOptions {
  std::filesystem::path result, truth, out;
};

Result<Measurement> read_result(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  try {
    auto measurement = measurement_from_json(nlohmann::json::parse(*text));
    if (!measurement) return invalid_input("{}: {}", path.string(), measurement.error().message);
    return measurement;
  } catch (const nlohmann::json::exception& error) {
    return invalid_input("{}: not a result file: {}", path.string(), error.what());
  }
}

int run_report(const ReportOptions& options, bool as_json) {
  const auto measurement = read_result(options.result);
  if (!measurement) return fail(measurement.error());
  std::optional<TruthComparison> truth;
  if (!options.truth.empty()) {
    const auto compared = compare_with_truth(*measurement, options.truth);
    if (!compared) return fail(compared.error());
    truth = *compared;
  }
  if (as_json) {
    nlohmann::json document = {{"result", to_json(*measurement)}};
    if (truth) {
      document["against_truth"] = to_json(*truth);
      document["length_error_mm"] = measurement->length_mm - truth->length_mm;
    }
    return print_json(document);
  }
  const std::string table = result_table(*measurement, truth ? &*truth : nullptr);
  if (!options.out.empty()) {
    if (auto written = write_file_atomically(options.out, table); !written) return fail(written.error());
  }
  std::cout << table;
  return 0;
}

}  // namespace

void add_report_command(Cli& cli) {
  auto options = std::make_shared<ReportOptions>();
  auto* command =
      cli.command(cli.app, "report", "a measured result for a person: as a table, beside the truth if it is known",
                  [options, &cli] { return run_report(*options, cli.json); });
  command->add_option("result", options->result, "result.json")->required();
  command->add_option("--out", options->out, "write the table here too");
  command->add_option("--truth", options->truth, "truth.json of a simulated forging: print the errors too");
}

}  // namespace imprint
