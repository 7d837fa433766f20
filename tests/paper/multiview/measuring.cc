#include "tests/paper/multiview/measuring.h"

#include <cmath>
#include <span>

#include "fusion/combine/combine_config.h"
#include "fusion/thesis/thesis_config.h"
#include "fusion/triangulate/triangulate_config.h"

namespace imprint::test {

void Errors::add(const Deviation& d) {
  axis += d.axis_rms * d.axis_rms;
  diameter += d.diameter_rms * d.diameter_rms;
  diameter90 += d.diameter_best90_rms * d.diameter_best90_rms;
  circularity += std::abs(d.circularity_mean) + d.circularity_sigma;
  length += d.length * d.length;
  axis_covered += d.axis_covered;
  diameter_covered += d.diameter_covered;
  circularity_covered += d.circularity_covered;
  ++count;
}

Errors Errors::mean() const {
  Errors m = *this;
  for (double* square : {&m.axis, &m.diameter, &m.diameter90, &m.length}) *square = std::sqrt(*square / count);
  for (double* sum : {&m.circularity, &m.axis_covered, &m.diameter_covered, &m.circularity_covered}) *sum /= count;
  return m;
}

Rod forging(const OutOfRound& out_of_round, unsigned seed) {
  Rod rod = stepped_rod();
  make_out_of_round(rod, out_of_round.mean_mm, out_of_round.wave_mm, seed);
  return rod;
}

Result<Reconstructed> reconstruct(const Session& session) {
  Reconstructed result;
  for (const std::vector<Imprint>& imprints : session.imprints) {
    auto observed = triangulate(imprints, session.spec, TriangulateConfig{});
    if (!observed) return pass_on(observed.error());
    std::vector<CameraView> views;
    for (std::size_t i = 0; i < imprints.size(); ++i)
      if (auto view = view_of(imprints[i], static_cast<int>(i), TriangulateConfig{}.min_rim_share))
        views.push_back(std::move(*view));
    auto curves = space_curves(views, session.spec, ThesisConfig{});
    if (!curves) return pass_on(curves.error());
    result.observed.push_back(std::move(*observed));
    result.curves.push_back(std::move(*curves));
  }
  return result;
}

Result<Measurement> measurement_of(const Session& session, const Reconstructed& all, std::size_t observations,
                                   Estimator estimator) {
  const auto rotations = std::span(session.rotations_deg).first(observations);
  auto combined =
      estimator == Estimator::joint
          ? combine(std::span(all.observed).first(observations), rotations, session.spec, CombineConfig{})
          : thesis_geometry(std::span(all.curves).first(observations), rotations, session.spec, ThesisConfig{});
  if (!combined) return pass_on(combined.error());
  combined->draws.clear();  // nothing here asks for them
  combined->shape.clear();
  return make_measurement(*combined, {}, "bench", "exact");
}

Result<Deviation> measure(const Rod& rod, const Session& session, const Reconstructed& all, std::size_t observations,
                          Estimator estimator) {
  const auto measured = measurement_of(session, all, observations, estimator);
  if (!measured) return pass_on(measured.error());
  return deviation(*measured, rod, session);
}

}  // namespace imprint::test
