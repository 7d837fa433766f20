#include "fusion/report/plot.h"

#include <cmath>
#include <limits>
#include <regex>

#include <catch2/catch.hpp>

#include "fusion/report/result_plots.h"

namespace imprint {
namespace {

int count(const std::string& text, const std::string& what) {
  int found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

// The labels of the y axis, from the top of the drawing down.
std::vector<std::string> y_labels(const std::string& svg) {
  std::vector<std::string> labels;
  const std::regex label("text-anchor=\"end\">(-?[0-9.]+)</text>");
  for (auto it = std::sregex_iterator(svg.begin(), svg.end(), label); it != std::sregex_iterator(); ++it)
    labels.push_back((*it)[1]);
  return labels;
}

Plot straight(double low, double high) {
  return {.x_label = "x",
          .y_label = "y",
          .low = low,
          .high = high,
          .points = {{0, low, 0}, {100, high, 0}},
          .reference = {},
          .mark = {}};
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("plot: the grid stands at round values with the digits they need") {
  REQUIRE(y_labels(draw(straight(0.0, 1.0))) == std::vector<std::string>{"0.0", "0.2", "0.4", "0.6", "0.8", "1.0"});
  REQUIRE(y_labels(draw(straight(-7.0, 12.0))) == std::vector<std::string>{"-5", "0", "5", "10"});
  REQUIRE(y_labels(draw(straight(199.93, 200.11))) == std::vector<std::string>{"199.95", "200.00", "200.05", "200.10"});
}

TEST_CASE("plot: a gap stays a gap") {
  Plot plot = straight(0.0, 1.0);
  plot.points = {{0, 0.1, 0.1}, {1, 0.2, 0.1}, {2, kNan, 0.1}, {3, kNan, 0.1}, {4, 0.4, 0.1}, {5, 0.5, 0.1}};
  const std::string svg = draw(plot);
  REQUIRE(count(svg, "class=\"curve\"") == 2);
  REQUIRE(count(svg, "class=\"band\"") == 2);
  REQUIRE(count(svg, "nan") == 0);
}

TEST_CASE("plot: the range holds every finite value and the least room beside them") {
  const std::vector<PlotPoint> a = {{0, 3.0, 0}, {1, kNan, 0}}, b = {{0, 5.0, 0}};
  const PlotRange range = range_of({&a, &b}, 0.5);
  REQUIRE(range.low == 2.5);
  REQUIRE(range.high == 5.5);
  const std::vector<PlotPoint> none;
  REQUIRE(range_of({&none}, 0.5).low < range_of({&none}, 0.5).high);
}

TEST_CASE("plot: numbers of a damaged file are drawn somehow, at once and without nan") {
  const double huge = std::numeric_limits<double>::max();
  for (const auto& [low, high] : std::vector<std::pair<double, double>>{
           {-huge, huge}, {1e20, 1e20}, {1e20, std::nextafter(1e20, huge)}, {0.0, 5e-324}, {2.0, 1.0}}) {
    CAPTURE(low, high);
    Plot plot = straight(low, high);
    plot.points.push_back({huge, -huge, huge});
    const std::string svg = draw(plot);
    REQUIRE(svg.size() < 10'000);
    REQUIRE(count(svg, "nan") == 0);
  }
  Plot empty = straight(0.0, 1.0);
  empty.points.clear();
  REQUIRE(count(draw(empty), "</svg>") == 1);
}

TEST_CASE("plot: labels are escaped") {
  Plot plot = straight(0.0, 1.0);
  plot.y_label = "a<b";
  REQUIRE(count(draw(plot), "a&lt;b") == 1);
}

TEST_CASE("result plots: both planes of the axis are on one scale, the truth beside the measured") {
  Measurement measurement;
  for (int i = 0; i < 500; ++i)
    measurement.sections.push_back({2.0 * i, {2.0 * i, 0.01 * i, -0.001 * i}, 0.01 * i, 200.0, 1.0, 0.1, 0.1, 0.1});
  const ResultPlots alone = draw_result(measurement);
  REQUIRE(y_labels(alone.axis_xy) == y_labels(alone.axis_xz));
  REQUIRE(count(alone.diameter, "class=\"reference\"") == 0);
  const ResultPlots compared = draw_result(measurement, measurement.sections);
  for (const std::string& svg : {compared.axis_xy, compared.axis_xz, compared.diameter, compared.circularity})
    REQUIRE(count(svg, "class=\"reference\"") == 1);
  REQUIRE(draw_result(Measurement{}).axis_xy.empty());
}

TEST_CASE("result plots: a few wide bands, as on the slopes of steps, do not press the diameter flat") {
  Measurement measurement;
  for (int i = 0; i < 500; ++i) {
    const bool slope = i >= 240 && i < 260;
    measurement.sections.push_back(
        {4.0 * i, {4.0 * i, 0.0, 0.0}, 0.0, i < 250 ? 180.0 : 300.0, 1.0, 0.3, slope ? 200.0 : 0.5, 0.3});
  }
  const auto labels = y_labels(draw_result(measurement).diameter);
  REQUIRE_FALSE(labels.empty());
  REQUIRE(std::stod(labels.front()) <= 320.0);  // 300 mm with the usual band and the plot's own padding
  REQUIRE(std::stod(labels.back()) >= 160.0);
}

TEST_CASE("result plots: the direction is drawn as one who stands at the first end sees it, z up and y to the left") {
  Measurement measurement;
  for (int i = 0; i < 3; ++i)
    measurement.sections.push_back({1.0 * i, {1.0 * i, 0.0, 0.0}, 0.0, 200.0, 1.0, 0.3, 0.3, 0.3});
  measurement.sections[1].axis_mm[1] = 3.0;
  measurement.sections[1].axis_mm[2] = 4.0;
  measurement.sections[1].deflection_mm = 5.0;
  REQUIRE(draw_result(measurement).direction.find("x2=\"-52.80\" y2=\"-70.40\" class=\"needle\"") != std::string::npos);
}

}  // namespace imprint
