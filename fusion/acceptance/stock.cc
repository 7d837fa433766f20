#include "fusion/acceptance/stock.h"

#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Dense>

#include "fusion/combine/rod_surface.h"

namespace imprint {
namespace {

constexpr int kDirections = 48;

/// One tangent of one section: stock = room - row . (middle y, z, slope y, z).
struct Tangent {
  double room_mm;
  Eigen::Vector4d row;
};

double support(const SectionShape& shape, double theta) {
  const Eigen::Vector2d normal(std::cos(theta), std::sin(theta));
  return shape.axis_mm.dot(normal) + shape.radius_mm + shape.harmonics_mm.dot(harmonics_of(normal));
}

}  // namespace

LeastStock least_stock(std::span<const StockSection> sections, const PartAxis& axis) {
  LeastStock least{.mm = std::numeric_limits<double>::infinity()};
  for (const StockSection& section : sections) {
    const Eigen::Vector2d at = axis.at(section.s_mm);
    for (int d = 0; d < kDirections; ++d) {
      const double theta = 2.0 * M_PI * d / kDirections;
      const double stock = support(*section.shape, theta) - at.dot(Eigen::Vector2d(std::cos(theta), std::sin(theta))) -
                           section.part_radius_mm;
      if (stock < least.mm) least = {stock, section.s_mm, theta};
    }
  }
  return least;
}

PartAxis best_part_axis(std::span<const StockSection> sections) {
  PartAxis axis;
  axis.s_middle_mm = 0.5 * (sections.front().s_mm + sections.back().s_mm);
  const double half = std::max(0.5 * (sections.back().s_mm - sections.front().s_mm), 1.0);
  std::vector<Tangent> tangents;
  for (const StockSection& section : sections) {
    const double lever = (section.s_mm - axis.s_middle_mm) / half;
    for (int d = 0; d < kDirections; ++d) {
      const double theta = 2.0 * M_PI * d / kDirections;
      const Eigen::Vector2d normal(std::cos(theta), std::sin(theta));
      Eigen::Vector4d row;
      row << normal, lever * normal;
      tangents.push_back({support(*section.shape, theta) - section.part_radius_mm, row});
    }
  }
  // The least of all stocks, smoothed: -log(sum exp(-b stock)) / b, concave; Newton's steps as b grows.
  Eigen::Vector4d place = Eigen::Vector4d::Zero();
  const auto smoothed = [&](const Eigen::Vector4d& at, double b, Eigen::Vector4d* gradient,
                            Eigen::Matrix4d* curvature) {
    double least = std::numeric_limits<double>::infinity();
    for (const Tangent& t : tangents) least = std::min(least, t.room_mm - t.row.dot(at));
    double sum = 0.0;
    Eigen::Vector4d mean = Eigen::Vector4d::Zero();
    Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
    for (const Tangent& t : tangents) {
      const double exponent = b * (t.room_mm - t.row.dot(at) - least);
      if (exponent > 40.0) continue;
      const double weight = std::exp(-exponent);
      sum += weight;
      if (gradient == nullptr) continue;
      mean += weight * t.row;
      squares += weight * t.row * t.row.transpose();
    }
    if (gradient != nullptr) {
      mean /= sum;
      *gradient = -mean;
      *curvature = b * (squares / sum - mean * mean.transpose());
    }
    return least - std::log(sum) / b;
  };
  for (double b = 0.25; b < 2000.0; b *= 2.0) {
    for (int iteration = 0; iteration < 6; ++iteration) {
      Eigen::Vector4d gradient;
      Eigen::Matrix4d curvature;
      const double now = smoothed(place, b, &gradient, &curvature);
      curvature.diagonal().array() += 1e-6 * (1.0 + curvature.trace());
      const Eigen::Vector4d step = curvature.ldlt().solve(gradient);
      double share = 1.0;
      while (share > 1e-4 && smoothed(place + share * step, b, nullptr, nullptr) < now) share *= 0.5;
      if (share <= 1e-4) break;
      place += share * step;
      if (share * step.norm() < 1e-5) break;
    }
  }
  axis.middle_mm = place.head<2>();
  axis.slope = place.tail<2>() / half;
  return axis;
}

}  // namespace imprint
