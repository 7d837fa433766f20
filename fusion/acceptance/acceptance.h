#pragma once

#include <string>
#include <vector>

#include "fusion/acceptance/nominal.h"
#include "fusion/results/measurement.h"

namespace imprint {

/// By ISO 14253-1: proven to conform, proven not to, or the interval holds a limit.
enum class Verdict { pass, fail, undecided };
std::string_view name_of(Verdict verdict);

/// `value` between two limits, all in mm; a limit may be infinite.
Verdict decide(const Length& value, double lower, double upper);

struct StepCheck {
  std::string name;
  Length smallest{}, largest{};  ///< diameters of the step, shoulders left out
  double smallest_at_mm = 0.0, largest_at_mm = 0.0;
  double lower_mm = 0.0, upper_mm = 0.0;  ///< limits of the diameter, as hot as the forging
  Verdict verdict = Verdict::undecided;
};

/// The finished part, placed in the forging so that its least stock is largest.
struct StockCheck {
  Length least{};                             ///< on the radius; below 0: it does not fit
  double least_at_mm = 0.0;                   ///< of the forging
  double direction_deg = 0.0;                 ///< of (y, z), from y towards z
  double shift_mm = 0.0;                      ///< of the part along the forging
  double y_first_mm = 0.0, z_first_mm = 0.0;  ///< its axis at the forging's first end, and at the last
  double y_last_mm = 0.0, z_last_mm = 0.0;
  double wanted_mm = 0.0;
  Verdict verdict = Verdict::undecided;
};

struct Acceptance {
  std::string nominal;
  std::vector<StepCheck> steps{};
  std::optional<StockCheck> stock{};      ///< where the nominal has a finished part and the sections' shapes are known
  std::optional<Verdict> straightness{};  ///< where it limits the deflection
  Verdict verdict = Verdict::undecided;   ///< fail when any fails, pass when all pass
};

/// The hot forging against the nominal, which is brought to its heat first when it is a cold one. Fails (invalid_input)
/// when that heat is not known, or the nominal does not lie on the forging.
Result<Acceptance> accept(const Measurement& measurement, const Nominal& nominal);

nlohmann::json to_json(const Acceptance& acceptance);

}  // namespace imprint
