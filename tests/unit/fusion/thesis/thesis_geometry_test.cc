#include "fusion/thesis/thesis_geometry.h"

#include <cmath>

#include <catch2/catch.hpp>

#include "fusion/triangulate/triangulate_config.h"
#include "tests/unit/fusion/triangulate/forging_sessions.h"

namespace imprint::test {
namespace {

std::vector<CameraView> views_of(const std::vector<Imprint>& imprints) {
  std::vector<CameraView> views;
  for (std::size_t i = 0; i < imprints.size(); ++i) {
    auto view = view_of(imprints[i], static_cast<int>(i), 0.05);
    REQUIRE(view.has_value());
    views.push_back(std::move(*view));
  }
  return views;
}

Measurement measure(const Session& session) {
  std::vector<SpaceCurves> curves;
  for (const auto& imprints : session.imprints) {
    auto one = space_curves(views_of(imprints), session.spec, ThesisConfig{});
    REQUIRE(one.has_value());
    curves.push_back(std::move(*one));
  }
  const auto combined = thesis_geometry(curves, session.rotations_deg, session.spec, ThesisConfig{});
  REQUIRE(combined.has_value());
  REQUIRE(combined->sections.size() == 500);
  return make_measurement(*combined, {}, "test", "best");
}

Deviation deviation_of(const Rod& rod, const Views& views) {
  const Session session = observe(rod, views);
  return deviation(measure(session), rod, session);
}

}  // namespace

TEST_CASE("thesis: exact views of a straight round rod give its axis to 0.01 mm and its diameter to 0.05 mm") {
  const Deviation d = deviation_of(bent_rod(1.0, 0.0), {});
  INFO(text(d));
  // How far the middle of the rims lies beside the axis is alike all along a straight rod: the alignment takes it out.
  CHECK(d.axis_max < 0.01);
  CHECK(d.diameter_rms < 0.05);
  CHECK(d.circularity_mean < 0.02);
  CHECK(std::abs(d.length) < 4.0);  // the axis begins at a station; they are 3.8 mm apart
}

TEST_CASE("thesis: a bent round rod keeps its bow to 0.1 mm") {
  const Deviation d = deviation_of(bent_rod(), {.noise_px = 0.1});
  INFO(text(d));
  CHECK(d.axis_rms < 0.1);
  CHECK(d.diameter_best90_rms < 0.1);
}

TEST_CASE("thesis: silhouettes lie at the corrected radius from the axis point of their own camera's group") {
  // [D] equation 4 and [C] equation 4 taken apart: one camera's silhouettes of a cylinder stand R = L tan a from the
  // axis, where sin a = r / L.
  const Rod rod = bent_rod(1.0, 0.0);
  const Session session = observe(rod, {});
  const auto curves = space_curves(views_of(session.imprints[0]), session.spec, ThesisConfig{});
  REQUIRE(curves.has_value());
  REQUIRE(curves->silhouettes.size() == 6);
  for (const Silhouette& silhouette : curves->silhouettes) {
    const Eigen::Vector3d& point = silhouette.points_mm[silhouette.points_mm.size() / 2];
    const Eigen::Vector3d in_rod = session.first.R.transpose() * (point - session.first.origin_mm);
    const Eigen::Vector3d center = session.first.R.transpose() * (silhouette.center_mm - session.first.origin_mm);
    const double distance = std::hypot(center.y(), center.z());
    const double radius = in_rod.tail<2>().norm();
    CHECK(radius > 130.0);
    CHECK(distance * std::sin(std::atan(radius / distance)) == Approx(130.0).margin(0.1));
  }
}

TEST_CASE("thesis: more observations turned by 30 degrees bring axis and diameter of an out-of-round rod nearer") {
  Rod rod = stepped_rod();
  make_out_of_round(rod, 5.0, 200.0, 11);
  const Deviation one = deviation_of(rod, {.noise_px = 0.1, .seed = 11});
  const Deviation six = deviation_of(rod, {.observations = 6, .noise_px = 0.1, .seed = 11});
  INFO(text(one));
  INFO(text(six));
  CHECK(six.axis_rms < 0.6 * one.axis_rms);
  CHECK(six.diameter_best90_rms < 0.6 * one.diameter_best90_rms);
  CHECK(std::abs(six.circularity_mean) < std::abs(one.circularity_mean));
}

TEST_CASE("thesis: the known rotation is turned back: with its sign wrong the bow is lost") {
  const Rod rod = bent_rod();
  Session session = observe(rod, {.observations = 2, .step_deg = 40.0, .seed = 4});
  CHECK(deviation(measure(session), rod, session).axis_rms < 0.2);
  for (double& rotation : session.rotations_deg) rotation = -rotation;
  CHECK(deviation(measure(session), rod, session).axis_rms > 1.0);
}

TEST_CASE("thesis: without an observation, or with rotations that do not fit, there is no geometry") {
  const ForgingSpec spec = forge_spec();
  CHECK_FALSE(thesis_geometry({}, {}, spec, ThesisConfig{}).has_value());
  const std::vector<SpaceCurves> one(1);
  const std::vector<double> none;
  CHECK_FALSE(thesis_geometry(one, none, spec, ThesisConfig{}).has_value());
  CHECK_FALSE(space_curves({}, spec, ThesisConfig{}).has_value());
}

}  // namespace imprint::test
