#include <filesystem>
#include <optional>

#include "cli/acceptance_table.h"
#include "cli/command.h"
#include "cli/hot_options.h"
#include "cli/report_page.h"
#include "cli/result_file.h"
#include "cli/result_table.h"
#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

struct ReportOptions {
  std::filesystem::path result, truth, out;
  HotOptions hot;
};

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
  auto cooling = cooling_from(options.hot);
  if (!cooling) return fail(cooling.error());
  auto read = read_result_file(options.result);
  if (!read) return fail(read.error());
  if (*cooling) {
    read->measurement.cooling = std::move(*cooling);
    read->document["cold"] = to_json(read->measurement)["cold"];
  }
  const Measurement* measurement = &read->measurement;
  std::optional<TruthComparison> truth;
  if (!options.truth.empty()) {
    auto comparison = compare_with_truth(*measurement, options.truth);
    if (!comparison) return fail(comparison.error());
    truth = std::move(*comparison);
  }
  const TruthComparison* compared = truth ? &*truth : nullptr;
  std::string table = result_table(*measurement, compared);
  for (const std::string& line : acceptance_lines(read->document)) table += "  " + line + "\n";
  table += warning_lines(*measurement);
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
  add_hot_options(*command, options->hot);
  command->add_option("--truth", options->truth, "truth.json of a simulated forging: show the errors too");
}

}  // namespace imprint
