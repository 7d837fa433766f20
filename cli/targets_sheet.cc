#include "cli/targets_sheet.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lib/config/atomic_file.h"
#include "lib/targets/sheet_layout.h"
#include "lib/targets/target_library.h"
#include "lib/targets/target_sheet.h"

namespace imprint {
namespace {

struct Options {
  std::filesystem::path library;
  std::filesystem::path out;
  std::string page = "A4";
  bool landscape = false;
  std::string ids;
  SheetLayout layout;
};

nlohmann::json to_json(const SheetPlan& plan, const SheetLayout& layout, const std::filesystem::path& out) {
  nlohmann::json targets = nlohmann::json::array();
  std::vector<int> per_page(static_cast<std::size_t>(plan.pages), 0);
  for (const PlacedTarget& target : plan.targets) {
    ++per_page[static_cast<std::size_t>(target.page)];
    targets.push_back(
        {{"id", target.code.id}, {"page", target.page + 1}, {"x_mm", target.x_mm}, {"y_mm", target.y_mm}});
  }
  return {{"out", out.string()},
          {"pages", plan.pages},
          {"page_width_mm", layout.page.width_mm},
          {"page_height_mm", layout.page.height_mm},
          {"plate", layout.page.plate},
          {"dot_diameter_mm", layout.dot_diameter_mm},
          {"ground_width_mm", plan.ground_width_mm},
          {"ground_height_mm", plan.ground_height_mm},
          {"scale_bar_mm", plan.scale_bar_mm},
          {"targets_per_page", per_page},
          {"targets", targets}};
}

Result<SheetLayout> layout_of(const Options& options) {
  SheetLayout layout = options.layout;
  const auto page = parse_sheet_page(options.page);
  if (!page) return pass_on(page.error());
  layout.page = *page;
  if (options.landscape) std::swap(layout.page.width_mm, layout.page.height_mm);
  if (options.ids.empty()) return layout;
  const auto ids = parse_id_list(options.ids);
  if (!ids) return pass_on(ids.error());
  layout.ids = *ids;
  return layout;
}

int run_sheet(const Cli& cli, const Options& options) {
  const auto layout = layout_of(options);
  if (!layout) return fail(layout.error());
  const auto library = read_target_library(options.library);
  if (!library) return fail(library.error());
  const auto plan = plan_target_sheet(*library, *layout);
  if (!plan) return fail(plan.error());
  const auto pdf = draw_target_sheet(*library, *layout, *plan);
  if (!pdf) return fail(pdf.error());
  if (const auto written = write_file_atomically(options.out, *pdf); !written) return fail(written.error());
  if (cli.json) return print_json(to_json(*plan, *layout, options.out));
  fmt::print("{}: {} targets on {} pages of {:g} x {:g} mm, to print at 100 %; the scale bars must measure {:g} mm\n",
             options.out.string(), plan->targets.size(), plan->pages, layout->page.width_mm, layout->page.height_mm,
             plan->scale_bar_mm);
  return 0;
}

}  // namespace

void add_targets_sheet(Cli& cli, CLI::App& targets) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = cli.command(targets, "sheet", "targets to print, true to scale",
                                  [&cli, options] { return run_sheet(cli, *options); });
  command->add_option("--library", options->library, "library.json")->required();
  command->add_option("--dot-diameter-mm", options->layout.dot_diameter_mm, "of the white dot")->capture_default_str();
  command
      ->add_option("--page", options->page,
                   "A4, A3, A2, A1, A0 or WIDTHxHEIGHT in mm, full of targets; plate=WIDTHxHEIGHT: one target a page, "
                   "black to the edges")
      ->capture_default_str();
  command->add_flag("--landscape", options->landscape, "the page lies on its side");
  command->add_option("--margin-mm", options->layout.margin_mm, "left free along the page's edges")
      ->capture_default_str();
  command->add_option("--border-dot-radii", options->layout.border_dot_radii, "least black outside the ring")
      ->capture_default_str();
  command->add_option("--ids", options->ids, "only these targets, in this order: 1,5,7-12");
  command->add_option("--out", options->out, "PDF to write")->required();
}

}  // namespace imprint
