#pragma once

#include <string>
#include <vector>

#include "fusion/results/measurement.h"

namespace imprint {

/// The pictures of a result, each a whole <svg> element (look.css styles it): the control-room page and the report
/// show the same ones.
struct ResultPlots {
  std::string axis_xy, axis_xz;  ///< the aligned axis in two planes, on one scale, with the zero in view
  std::string diameter, circularity;
  std::string direction;  ///< of the largest deflection, seen along +x from the first end, z up and so y to the left
};

/// `reference` are the sections the result is compared with (the truth of a simulated forging); may be empty.
ResultPlots draw_result(const Measurement& measurement, const std::vector<Measurement::Section>& reference = {});

}  // namespace imprint
