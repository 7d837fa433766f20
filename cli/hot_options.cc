#include "cli/hot_options.h"

namespace imprint {

void add_hot_options(CLI::App& command, HotOptions& options) {
  auto* steel =
      command.add_option("--steel", options.grade, "grade or steel (42CrMo4, carbon, ...): the cold values too");
  auto* temperature =
      command.add_option("--temperature-c", options.temperature_c, "of the forging when it was seen, in C");
  steel->needs(temperature);
  temperature->needs(steel);
  command.add_option("--temperature-sigma-c", options.temperature_sigma_c, "its standard deviation, in C")
      ->check(CLI::Range(0.0, 500.0))
      ->needs(temperature)
      ->capture_default_str();
  command.add_option("--temperature-source", options.source, "who says so; stands in the result")
      ->needs(temperature)
      ->capture_default_str();
  command.add_option("--steels", options.steels, "a table of expansion of one's own (TOML)")->needs(steel);
}

Result<std::optional<Cooling>> cooling_from(const HotOptions& options) {
  if (options.grade.empty()) return std::optional<Cooling>();
  const auto steels = options.steels.empty() ? known_steels() : read_steels(options.steels);
  if (!steels) return pass_on(steels.error());
  auto cooling =
      cooling_of(*steels, options.grade, {options.temperature_c, options.temperature_sigma_c, options.source});
  if (!cooling) return pass_on(cooling.error());
  return std::optional<Cooling>(std::move(*cooling));
}

}  // namespace imprint
