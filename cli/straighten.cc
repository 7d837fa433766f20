#include <filesystem>
#include <sstream>

#include <fmt/core.h>

#include "cli/command.h"
#include "cli/result_file.h"
#include "fusion/straightening/advice.h"
#include "lib/config/atomic_file.h"
#include "lib/config/csv_row.h"

namespace imprint {
namespace {

struct StraightenOptions {
  std::filesystem::path result, out, pairs;
  double end_section_mm = 80.0;
  StraighteningConfig config;
};

// before.json,after.json,at_mm,support_first_mm,support_last_mm,travel_mm; paths relative to the file.
Result<std::vector<StrokeRecord>> read_pairs(const std::filesystem::path& path, double usual_springback) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  std::vector<StrokeRecord> records;
  std::istringstream lines(*text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto cells = csv_cells(line);
    if (trimmed(line).empty() || (number == 1 && cells.front() == "before")) continue;
    Stroke stroke;
    if (cells.size() != 6 || !parse_number(cells[2], stroke.at_mm) ||
        !parse_number(cells[3], stroke.support_first_mm) || !parse_number(cells[4], stroke.support_last_mm) ||
        !parse_number(cells[5], stroke.travel_mm) ||
        !(stroke.support_first_mm < stroke.at_mm && stroke.at_mm < stroke.support_last_mm))
      return invalid_input(
          "{}:{}: expected before.json,after.json,at_mm,support_first_mm,support_last_mm,travel_mm with the ram "
          "between "
          "the supports, found {}",
          path.string(), number, trimmed(line));
    stroke.bend_mm = stroke.travel_mm / usual_springback;
    const auto folder = std::filesystem::absolute(path).parent_path();
    const auto before = read_result_file(folder / cells[0]);
    if (!before) return pass_on(before.error());
    const auto after = read_result_file(folder / cells[1]);
    if (!after) return pass_on(after.error());
    records.push_back(record_of(before->measurement, after->measurement, stroke));
  }
  return records;
}

std::string text_of(const StraighteningAdvice& advice, const StraighteningConfig& config) {
  std::string text = fmt::format("Largest deflection {:.2f} +- {:.2f} mm: {}\n", advice.max_deflection.mm,
                                 advice.max_deflection.ci95_mm, advice.reason);
  int number = 1;
  for (const Stroke& stroke : advice.strokes)
    text += fmt::format(
        "  stroke {}: turn by {:+.0f} deg, supports at {:.0f} and {:.0f} mm, press at {:.0f} mm, {:.2f} mm from "
        "contact ({:.2f} "
        "mm stay, springback {:.2f}); then {:.2f} mm\n",
        number++, stroke.turn_deg, stroke.support_first_mm, stroke.support_last_mm, stroke.at_mm, stroke.travel_mm,
        stroke.bend_mm, config.springback, stroke.predicted_max_deflection_mm);
  return text;
}

int run_straighten(StraightenOptions options, bool as_json) {
  const auto read = read_result_file(options.result);
  if (!read) return fail(read.error());
  if (!options.pairs.empty()) {
    const auto records = read_pairs(options.pairs, options.config.springback);
    if (!records) return fail(records.error());
    const auto learnt = learn_springback(*records);
    if (!learnt) return fail({learnt.error().kind, options.pairs.string() + ": " + learnt.error().message});
    options.config.springback = *learnt;
  }
  const auto advice = advise(read->measurement, options.end_section_mm, options.config);
  if (!advice) return fail(advice.error());
  auto document = to_json(*advice);
  document["springback"] = options.config.springback;
  if (!options.out.empty())
    if (auto written = write_file_atomically(options.out, document.dump(1) + "\n"); !written)
      return fail(written.error());
  if (as_json) return print_json(document);
  std::cout << text_of(*advice, options.config);
  return 0;
}

}  // namespace

void add_straighten_command(Cli& cli) {
  auto options = std::make_shared<StraightenOptions>();
  auto* command =
      cli.command(cli.app, "straighten", "where to press a bent forging, turned how, between which supports",
                  [options, &cli] { return run_straighten(*options, cli.json); });
  command->add_option("result", options->result, "result.json")->required();
  command->add_option("--tolerance-mm", options->config.tolerance_mm, "deflection that is allowed")->required();
  command->add_option("--span-mm", options->config.support_span_mm, "between the supports")->capture_default_str();
  command->add_option("--end-margin-mm", options->config.end_margin_mm, "supports stand so far from either end")
      ->capture_default_str();
  command->add_option("--press-direction-deg", options->config.press_direction_deg, "the ram's way, from y towards z")
      ->capture_default_str();
  command->add_option("--springback", options->config.springback, "ram travel over what stays bent")
      ->capture_default_str();
  command->add_option("--pairs", options->pairs, "learn it from strokes measured before and after (CSV)");
  command->add_option("--strokes", options->config.most_strokes, "at most")->capture_default_str();
  command->add_option("--end-section-mm", options->end_section_mm, "as in rig.toml")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--out", options->out, "write the advice here (JSON)");
}

}  // namespace imprint
