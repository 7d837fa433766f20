#include <filesystem>

#include <fmt/core.h>

#include "cli/command.h"
#include "cli/command_line.h"
#include "lib/targets/coordinate_list.h"

namespace imprint {
namespace {

struct ImportOptions {
  std::filesystem::path list, out;
  CoordinateListFormat format;
};

int run_import(const ImportOptions& options, bool as_json) {
  const auto field = read_coordinate_list(options.list, options.format);
  if (!field) return fail(field.error());
  if (auto written = write_target_field(*field, options.out); !written) return fail(written.error());
  if (as_json) return print_json({{"field", options.out.string()}, {"targets", field->targets.size()}});
  fmt::print("{} targets written to {}\n", field->targets.size(), options.out.string());
  return 0;
}

}  // namespace

void add_field_command(Cli& cli) {
  CLI::App* field = cli.app.add_subcommand("field", "the target field's coordinates");
  field->require_subcommand(1);
  auto options = std::make_shared<ImportOptions>();
  auto* command = cli.command(*field, "import", "field.csv from another program's coordinate list",
                              [options, &cli] { return run_import(*options, cli.json); });
  command->add_option("list", options->list, "rows divided by commas, semicolons, tabs or blanks")->required();
  command->add_option("--out", options->out, "field.csv to write")->required();
  command->add_option("--columns", options->format.columns, "its columns: id, x, y, z, sigma; others are skipped")
      ->capture_default_str();
  command->add_option("--skip-lines", options->format.skip_lines, "lines before the first row")->check(between(0, 1e6));
  const std::map<std::string, double> units{{"mm", 1.0}, {"cm", 10.0}, {"m", 1000.0}, {"in", 25.4}};
  command->add_option("--unit", options->format.mm_per_unit, "mm, cm, m or in")
      ->transform(CLI::CheckedTransformer(units).description(""))
      ->type_name("UNIT")
      ->default_str("mm");
}

}  // namespace imprint
