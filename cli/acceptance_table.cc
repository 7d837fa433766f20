#include "cli/acceptance_table.h"

#include <fmt/core.h>

namespace imprint {
namespace {

std::vector<std::string> lines_of(const nlohmann::json& nominal) {
  const auto number = [](const nlohmann::json& from, const char* key) { return from.at(key).get<double>(); };
  std::vector<std::string> lines;
  lines.push_back(fmt::format("Against nominal \"{}\" (ISO 14253-1): {}", nominal.at("nominal").get<std::string>(),
                              nominal.at("verdict").get<std::string>()));
  for (const auto& step : nominal.at("steps"))
    lines.push_back(fmt::format(
        "{}: {} - {:.2f} +- {:.2f} mm (at {:.0f}) to {:.2f} +- {:.2f} mm (at {:.0f}), allowed "
        "{:.2f} to {:.2f} mm",
        step.at("name").get<std::string>(), step.at("verdict").get<std::string>(), number(step, "min_mm"),
        number(step, "min_ci95_mm"), number(step, "min_at_mm"), number(step, "max_mm"), number(step, "max_ci95_mm"),
        number(step, "max_at_mm"), number(step, "lower_mm"), number(step, "upper_mm")));
  if (nominal.contains("straightness"))
    lines.push_back("straightness: " + nominal.at("straightness").at("verdict").get<std::string>());
  if (nominal.contains("stock")) {
    const auto& stock = nominal.at("stock");
    lines.push_back(fmt::format(
        "finished part: {} - {}, least stock {:.2f} +- {:.2f} mm on the radius at {:.0f} mm towards {:.0f} deg, {:.2f} "
        "mm "
        "wanted; it begins {:.0f} mm from the first end",
        stock.at("verdict").get<std::string>(), stock.at("fits").get<bool>() ? "fits inside" : "does not fit inside",
        number(stock, "least_mm"), number(stock, "least_ci95_mm"), number(stock, "least_at_mm"),
        number(stock, "direction_deg"), number(stock, "wanted_mm"), number(stock, "shift_mm")));
  }
  return lines;
}

}  // namespace

std::vector<std::string> acceptance_lines(const nlohmann::json& result) {
  if (!result.contains("nominal")) return {};
  try {
    return lines_of(result.at("nominal"));
  } catch (const nlohmann::json::exception&) {
    return {};
  }
}

}  // namespace imprint
