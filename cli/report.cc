#include <filesystem>
#include <optional>

#include "cli/command.h"
#include "cli/report_page.h"
#include "cli/result_table.h"
#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

struct ReportOptions {
  std::filesystem::path result, truth, out;
};

struct ReadResult {
  Measurement measurement;
  nlohmann::json document;  // with what this program does not know of
};

Result<ReadResult> read_result(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  try {
    auto document = nlohmann::json::parse(*text);
    auto measurement = measurement_from_json(document);
    if (!measurement) return invalid_input("{}: {}", path.string(), measurement.error().message);
    if (measurement->sections.empty())
      return invalid_input("{}: expected a result with sections, found none", path.string());
    return ReadResult{std::move(*measurement), std::move(document)};
  } catch (const nlohmann::json::exception& error) {
    return invalid_input("{}: not a result file: {}", path.string(), error.what());
  }
}

enum class Form { table, page };

// What the name of the report asks for.
Result<Form> form_of(const std::filesystem::path& out) {
  const std::string extension = out.extension().string();
  if (extension == ".html" || extension == ".htm") return Form::page;
  if (out.empty() || extension == ".txt") return Form::table;
  return invalid_input("{}: expected a name that ends in .html or .txt", out.string());
}

int run_report(const ReportOptions& options, bool as_json) {
  const auto form = form_of(options.out);
  if (!form) return fail(form.error());
  const auto read = read_result(options.result);
  if (!read) return fail(read.error());
  const Measurement* measurement = &read->measurement;
  std::optional<TruthComparison> truth;
  if (!options.truth.empty()) {
    auto comparison = compare_with_truth(*measurement, options.truth);
    if (!comparison) return fail(comparison.error());
    truth = std::move(*comparison);
  }
  const TruthComparison* compared = truth ? &*truth : nullptr;
  const std::string table = result_table(*measurement, compared) + warning_lines(*measurement);
  if (!options.out.empty()) {
    const std::string report = *form == Form::page ? report_page(*measurement, read->document, compared) : table;
    if (auto written = write_file_atomically(options.out, report); !written) return fail(written.error());
  }
  if (as_json) {
    nlohmann::json document = {{"result", to_json(*measurement)}};
    if (truth) {
      document["against_truth"] = to_json(*truth);
      document["length_error_mm"] = measurement->length_mm - truth->length_mm;
    }
    return print_json(document);
  }
  std::cout << table;
  return 0;
}

}  // namespace

void add_report_command(Cli& cli) {
  auto options = std::make_shared<ReportOptions>();
  auto* command = cli.command(cli.app, "report",
                              "a measured result for a person: a table or a page, beside the truth if it is known",
                              [options, &cli] { return run_report(*options, cli.json); });
  command->add_option("result", options->result, "result.json")->required();
  command->add_option("--out", options->out,
                      "write it here too: a page for paper and archive (.html) or the table (.txt)");
  command->add_option("--truth", options->truth, "truth.json of a simulated forging: show the errors too");
}

}  // namespace imprint
