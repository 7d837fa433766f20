#include <filesystem>

#include <fmt/core.h>

#include "cli/command.h"
#include "cli/result_file.h"
#include "fusion/comparison/comparison.h"
#include "fusion/comparison/point_cloud.h"
#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

struct CompareOptions {
  std::filesystem::path result, cloud, out;
  double scale = 1.0;
  CompareConfig config;
};

// [D] table 1.
std::string table(const Comparison& c) {
  std::string text = fmt::format("{} of {} sections compared; cloud {}shifted by {:+.1f} mm, turned by {:+.1f} deg\n",
                                 c.sections, c.of_sections, c.reversed ? "reversed, " : "", c.shift_mm, c.turn_deg);
  text += fmt::format("  {:<24} {:>10} {:>10} {:>12}\n", "result less cloud", "deflection", "diameter", "circularity");
  const auto row = [&](const char* what, auto value, const char* unit) {
    text += fmt::format("  {:<24} {:>10} {:>10} {:>12}\n", fmt::format("{}, {}", what, unit), value(c.axis),
                        value(c.diameter), value(c.circularity));
  };
  row(
      "overlap of intervals", [](const Agreement& a) { return fmt::format("{:.2f}", 100.0 * a.overlap); }, "%");
  row(
      "mean difference", [](const Agreement& a) { return fmt::format("{:+.3f}", a.mean_mm); }, "mm");
  row(
      "median difference", [](const Agreement& a) { return fmt::format("{:+.3f}", a.median_mm); }, "mm");
  row(
      "RMS difference", [](const Agreement& a) { return fmt::format("{:.3f}", a.rms_mm); }, "mm");
  return text;
}

int run_compare(const CompareOptions& options, bool as_json) {
  const auto read = read_result_file(options.result);
  if (!read) return fail(read.error());
  auto cloud = read_point_cloud(options.cloud, options.scale);
  if (!cloud) return fail(cloud.error());
  const auto comparison = compare(read->measurement, std::move(*cloud), options.config);
  if (!comparison) return fail({comparison.error().kind, options.cloud.string() + ": " + comparison.error().message});
  const auto document = to_json(*comparison);
  if (!options.out.empty())
    if (auto written = write_file_atomically(options.out, document.dump(1) + "\n"); !written)
      return fail(written.error());
  if (as_json) return print_json(document);
  std::cout << table(*comparison);
  return 0;
}

}  // namespace

void add_compare_command(Cli& cli) {
  auto options = std::make_shared<CompareOptions>();
  auto* command = cli.command(cli.app, "compare", "a result beside an independent system's point cloud of the forging",
                              [options, &cli] { return run_compare(*options, cli.json); });
  command->add_option("result", options->result, "result.json")->required();
  command->add_option("cloud", options->cloud, "point cloud, cropped to the forging: .ply, .xyz, .txt, .asc or .csv")
      ->required();
  command->add_option("--scale", options->scale, "mm per unit of the cloud: 1000 for metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--end-section-mm", options->config.end_section_mm, "length of the cloud's two end sections")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      ->add_option("--slice-mm", options->config.slice_mm, "width of a cross-section's slice, about two point spacings")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("--same-frame", options->config.same_frame,
                    "the cloud is in the rig's world frame: do not register it");
  command->add_option("--out", options->out, "write the comparison here (JSON)");
}

}  // namespace imprint
