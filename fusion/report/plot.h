#pragma once

#include <optional>
#include <string>
#include <vector>

namespace imprint {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;     ///< not finite: a gap
  double ci95 = 0.0;  ///< half-width of the band
};

/// One curve with its 95 % band, drawn as SVG. Classes (look.css): grid, zero, band, curve, reference, mark.
struct Plot {
  std::string x_label, y_label;
  double low = 0.0, high = 1.0;  ///< range of y; the band is cut off there
  std::vector<PlotPoint> points;
  std::vector<PlotPoint> reference;  ///< what the curve is compared with; may be empty
  std::optional<PlotPoint> mark;
};

struct PlotRange {
  double low = 0.0, high = 1.0;
};

/// Range of the finite y of all points and references, and at least `least` beyond it either way.
PlotRange range_of(const std::vector<const std::vector<PlotPoint>*>& curves, double least);

/// A whole <svg> element, well-formed as XML. Texts are escaped.
std::string draw(const Plot& plot);

}  // namespace imprint
