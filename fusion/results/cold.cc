#include "fusion/results/cold.h"

#include <cmath>

namespace imprint {

Length Cooling::cold(const Length& hot_length) const {
  constexpr double kCi95 = 1.959964;
  const double shrunk = 1.0 / (1.0 + expansion.share);
  return {hot_length.mm * shrunk,
          std::hypot(hot_length.ci95_mm * shrunk, kCi95 * expansion.sigma * hot_length.mm * shrunk * shrunk)};
}

Result<Cooling> cooling_of(const std::vector<Steel>& steels, const std::string& grade, const HotState& hot) {
  const auto steel = find_steel(steels, grade);
  if (!steel) return pass_on(steel.error());
  const auto expansion = expansion_at(*steel, hot.temperature_c, hot.temperature_sigma_c);
  if (!expansion) return pass_on(expansion.error());
  return Cooling{grade, steel->name, steel->source, hot, *expansion};
}

}  // namespace imprint
