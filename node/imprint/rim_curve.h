#pragma once

#include <optional>
#include <vector>

#include "node/edge/locate_edges.h"
#include "node/imprint/make_imprint.h"

namespace imprint {

/// A sample of a curve with the trust put into it.
struct CurveSample {
  double station_px = 0.0;
  double offset_px = 0.0;
  double weight = 1.0;  ///< 0 to 1
};

using RimCurve = std::vector<CurveSample>;  ///< ascending station

/// Index range [first, last) of the samples that stand within `half` stations of `station`.
struct SampleRange {
  std::size_t first = 0, last = 0;
};
SampleRange samples_near(const RimCurve& curve, double station_px, double half);

/// A parabola about a station: value(x) = c0 + c1 (x - station) + c2 (x - station)^2.
struct LocalParabola {
  double station_px = 0.0;
  double c0 = 0.0, c1 = 0.0, c2 = 0.0;

  [[nodiscard]] double at(double station) const {
    const double x = station - station_px;
    return c0 + x * (c1 + x * c2);
  }
};

/// The weighted least-squares polynomial (degree 0 to 2, less where the samples do not carry it) about `station`
/// through the samples [first, last); nothing when their weights sum to zero.
std::optional<LocalParabola> fit_parabola(const CurveSample* first, const CurveSample* last, double station_px,
                                          int degree);

/// Value of that polynomial at `station`.
std::optional<double> fit_at_station(const RimCurve& curve, SampleRange range, double station_px, int degree);

/// The middle of both rims at the stations where both were seen, with the lower of their weights, [C] 2.3.2.
RimCurve middle_of(const RimCurve& upper, const RimCurve& lower);

}  // namespace imprint
