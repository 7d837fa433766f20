#include "node/imprint/rim_curve.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace imprint {

SampleRange samples_near(const RimCurve& curve, double station_px, double half) {
  const auto before = [](const CurveSample& s, double station) { return s.station_px < station; };
  const auto after = [](double station, const CurveSample& s) { return station < s.station_px; };
  const auto first = std::lower_bound(curve.begin(), curve.end(), station_px - half, before);
  const auto last = std::upper_bound(first, curve.end(), station_px + half, after);
  return {static_cast<std::size_t>(first - curve.begin()), static_cast<std::size_t>(last - curve.begin())};
}

std::optional<LocalParabola> fit_parabola(const CurveSample* first, const CurveSample* last, double station_px,
                                          int degree) {
  double m[5] = {}, r[3] = {}, low = 1e300, high = -1e300;
  int count = 0;
  for (const CurveSample* s = first; s != last; ++s) {
    const double w = s->weight, x = s->station_px - station_px, y = s->offset_px;
    if (!(w > 0)) continue;
    const double wx = w * x, wxx = wx * x;
    m[0] += w, m[1] += wx, m[2] += wxx, m[3] += wxx * x, m[4] += wxx * x * x;
    r[0] += w * y, r[1] += wx * y, r[2] += wxx * y;
    low = std::min(low, x), high = std::max(high, x);
    ++count;
  }
  if (!(m[0] > 0)) return std::nullopt;
  // Outside its samples a parabola runs away: a line at most, further out their mean.
  if (low > 1 || high < -1) degree = std::min(degree, low > 3 || high < -3 ? 0 : 1);
  if (degree >= 2 && count >= 4) {
    Eigen::Matrix3d a;
    a << m[0], m[1], m[2], m[1], m[2], m[3], m[2], m[3], m[4];
    const Eigen::LDLT<Eigen::Matrix3d> solver(a);
    if (solver.info() == Eigen::Success && solver.vectorD().minCoeff() > 1e-9 * m[0]) {
      const Eigen::Vector3d c = solver.solve(Eigen::Vector3d(r[0], r[1], r[2]));
      return LocalParabola{station_px, c[0], c[1], c[2]};
    }
  }
  const double det = m[0] * m[2] - m[1] * m[1];
  if (degree >= 1 && count >= 2 && det > 1e-9 * m[0] * m[0])
    return LocalParabola{station_px, (m[2] * r[0] - m[1] * r[1]) / det, (m[0] * r[1] - m[1] * r[0]) / det, 0.0};
  return LocalParabola{station_px, r[0] / m[0], 0.0, 0.0};
}

std::optional<double> fit_at_station(const RimCurve& curve, SampleRange range, double station_px, int degree) {
  const auto fit = fit_parabola(curve.data() + range.first, curve.data() + range.last, station_px, degree);
  return fit ? std::optional(fit->c0) : std::nullopt;
}

RimCurve middle_of(const RimCurve& upper, const RimCurve& lower) {
  RimCurve middle;
  for (std::size_t i = 0, k = 0; i < upper.size() && k < lower.size();) {
    const double apart = upper[i].station_px - lower[k].station_px;
    if (std::abs(apart) < 1e-6) {
      middle.push_back({upper[i].station_px, 0.5 * (upper[i].offset_px + lower[k].offset_px),
                        std::min(upper[i].weight, lower[k].weight)});
      ++i, ++k;
    } else if (apart < 0) {
      ++i;
    } else {
      ++k;
    }
  }
  return middle;
}

}  // namespace imprint
