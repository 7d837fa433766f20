#pragma once

#include <cstddef>
#include <vector>

#include "fusion/thesis/thesis_geometry.h"
#include "tests/unit/fusion/triangulate/forging_sessions.h"

namespace imprint::test {

/// Errors against the truth of one way of measuring, over all forgings.
struct Errors {
  double axis = 0.0, diameter = 0.0, diameter90 = 0.0, circularity = 0.0, length = 0.0;
  double axis_covered = 0.0, diameter_covered = 0.0, circularity_covered = 0.0;
  int count = 0;

  void add(const Deviation& d);
  [[nodiscard]] Errors mean() const;
};

struct OutOfRound {
  double mean_mm = 5.0;
  double wave_mm = 200.0;  ///< how quickly it changes along the forging
};
/// A forging with shoulders of 3 mm per mm.
Rod forging(const OutOfRound& out_of_round, unsigned seed);

/// Every observation of a session reconstructed once, for either estimator.
struct Reconstructed {
  std::vector<ObservedForging> observed;
  std::vector<SpaceCurves> curves;  ///< for the thesis's
};
Result<Reconstructed> reconstruct(const Session& session);

enum class Estimator { joint, thesis };

/// The first `observations` of them measured.
Result<Measurement> measurement_of(const Session& session, const Reconstructed& all, std::size_t observations,
                                   Estimator estimator);
/// The same against the truth.
Result<Deviation> measure(const Rod& rod, const Session& session, const Reconstructed& all, std::size_t observations,
                          Estimator estimator);

}  // namespace imprint::test
