#include "fusion/report/plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/core.h>

#include "fusion/report/markup.h"

namespace imprint {
namespace {

constexpr double kWidth = 900.0, kHeight = 300.0;
constexpr double kLeft = 74.0, kRight = 14.0, kTop = 14.0, kBottom = 52.0;  // margins, for the numbers
constexpr double kSameAsZero = 1e-9;

struct Ticks {
  std::vector<double> at;
  int digits = 0;
};

// Round steps of 1, 2 or 5, so that a value can be read off the grid.
// None when the numbers are too far from the field's to be told apart (a damaged file).
Ticks ticks(double low, double high, int wanted) {
  const double rough = (high - low) / wanted;
  if (!(rough > kSameAsZero * std::max({std::abs(low), std::abs(high), kSameAsZero})) || !std::isfinite(rough))
    return {};
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= rough) step = factor * power;
  }
  Ticks result;
  result.digits = std::max(0, static_cast<int>(-std::floor(std::log10(step) + kSameAsZero)));
  const auto first = static_cast<long>(std::ceil(low / step - kSameAsZero));
  const auto last = static_cast<long>(std::floor(high / step + kSameAsZero));
  for (long i = first; i <= last; ++i) result.at.push_back(static_cast<double>(i) * step);
  return result;
}

// Runs of points that have a value: a gap stays a gap.
std::vector<std::vector<PlotPoint>> runs(const std::vector<PlotPoint>& points) {
  std::vector<std::vector<PlotPoint>> result(1);
  for (const PlotPoint& point : points) {
    if (std::isfinite(point.y)) {
      result.back().push_back(point);
    } else if (!result.back().empty()) {
      result.emplace_back();
    }
  }
  if (result.back().empty()) result.pop_back();
  return result;
}

class Drawing {
 public:
  explicit Drawing(const Plot& plot) : plot_(plot) {
    for (const PlotPoint& point : plot.points) {
      x_low_ = std::min(x_low_, point.x);
      x_high_ = std::max(x_high_, point.x);
    }
    x_span_ = span(x_low_, x_high_);
    y_span_ = span(plot.low, plot.high);
  }

  std::string svg() {
    svg_ =
        fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\">", kWidth, kHeight);
    draw_grid();
    for (const auto& run : runs(plot_.points)) draw_band(run);
    for (const auto& run : runs(plot_.points)) draw_line(run, "curve");
    for (const auto& run : runs(plot_.reference)) draw_line(run, "reference");
    if (plot_.mark) {
      svg_ += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"8\" class=\"mark\"/>", to_x(plot_.mark->x),
                          to_y(plot_.mark->y));
    }
    return std::move(svg_) + "</svg>";
  }

 private:
  static double span(double low, double high) { return high > low && std::isfinite(high - low) ? high - low : 1.0; }

  [[nodiscard]] double to_x(double x) const { return kLeft + (x - x_low_) / x_span_ * (kWidth - kLeft - kRight); }
  [[nodiscard]] double to_y(double y) const {
    const double inside = std::clamp((y - plot_.low) / y_span_, 0.0, 1.0);
    return kTop + (1.0 - inside) * (kHeight - kTop - kBottom);
  }

  void line(double x1, double y1, double x2, double y2, const char* kind) {
    svg_ += fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" class=\"{}\"/>", x1, y1, x2, y2,
                        kind);
  }
  void text(double x, double y, const char* anchor, const std::string& content) {
    svg_ +=
        fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"{}\">{}</text>", x, y, anchor, markup_text(content));
  }

  void draw_grid() {
    const Ticks across = ticks(plot_.low, plot_.high, 5);
    for (const double y : across.at) {
      line(kLeft, to_y(y), kWidth - kRight, to_y(y), std::abs(y) < kSameAsZero ? "zero" : "grid");
      text(kLeft - 8.0, to_y(y) + 5.0, "end", fmt::format("{:.{}f}", y, across.digits));
    }
    const Ticks along = ticks(x_low_, x_high_, 8);
    for (const double x : along.at) {
      line(to_x(x), kTop, to_x(x), kHeight - kBottom, "grid");
      text(to_x(x), kHeight - kBottom + 20.0, "middle", fmt::format("{:.{}f}", x, along.digits));
    }
    text(kWidth - kRight, kHeight - 8.0, "end", plot_.x_label);
    text(4.0, kHeight - 8.0, "start", plot_.y_label);
  }

  void draw_band(const std::vector<PlotPoint>& run) {
    std::string corners;
    for (const PlotPoint& p : run) corners += fmt::format("{:.2f},{:.2f} ", to_x(p.x), to_y(p.y + p.ci95));
    for (auto p = run.rbegin(); p != run.rend(); ++p)
      corners += fmt::format("{:.2f},{:.2f} ", to_x(p->x), to_y(p->y - p->ci95));
    corners.pop_back();
    svg_ += fmt::format("<polygon points=\"{}\" class=\"band\"/>", corners);
  }

  void draw_line(const std::vector<PlotPoint>& run, const char* kind) {
    std::string points;
    for (const PlotPoint& p : run) points += fmt::format("{:.2f},{:.2f} ", to_x(p.x), to_y(p.y));
    points.pop_back();
    svg_ += fmt::format("<polyline points=\"{}\" class=\"{}\"/>", points, kind);
  }

  const Plot& plot_;
  double x_low_ = std::numeric_limits<double>::infinity();
  double x_high_ = -std::numeric_limits<double>::infinity();
  double x_span_ = 1.0, y_span_ = 1.0;
  std::string svg_;
};

}  // namespace

PlotRange range_of(const std::vector<const std::vector<PlotPoint>*>& curves, double least) {
  constexpr double kPadding = 0.08;  // of the range
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto* curve : curves) {
    for (const PlotPoint& point : *curve) {
      if (!std::isfinite(point.y)) continue;
      low = std::min(low, point.y);
      high = std::max(high, point.y);
    }
  }
  if (!(low <= high)) return {};
  const double padding = std::max(kPadding * (high - low), least);
  return {low - padding, high + padding};
}

std::string draw(const Plot& plot) { return Drawing(plot).svg(); }

}  // namespace imprint
