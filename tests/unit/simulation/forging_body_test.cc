#include "simulation/forging_body.h"

#include <cmath>
#include <numbers>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

constexpr double end_section_mm = 80.0;

ForgingScene stepped_scene() {
  ForgingScene scene;
  scene.stations = {{0.0, 180.0}, {300.0, 300.0}, {1500.0, 220.0}};
  scene.kink_mm = 2.0;
  return scene;
}

ForgingScene bar_scene(int faces) {
  ForgingScene scene;
  scene.stations = {{0.0, 300.0}};
  scene.faces = faces;
  scene.circularity_mm = 0.0;
  scene.press_marks = 0;
  return scene;
}

ForgingBody body_of(const ForgingScene& scene, std::uint64_t seed = 7) {
  auto body = ForgingBody::make(scene, end_section_mm, seed);
  REQUIRE(body);
  return *body;
}

}  // namespace

TEST_CASE("forging body: the derivatives of the support function are those of its values") {
  const ForgingBody body = body_of(stepped_scene());
  constexpr double d = 1e-5;
  for (const double x : {12.0, 290.0, 305.0, 800.0, 1503.0, 1880.0}) {
    const SectionShape here = body.section(x), before = body.section(x - d), after = body.section(x + d);
    for (double phi = 0.1; phi < 6.2; phi += 0.7) {
      const auto s = here.support(phi);
      CHECK(s.h_phi == Approx((here.support(phi + d).h - here.support(phi - d).h) / (2 * d)).margin(1e-6));
      CHECK(s.h_phiphi == Approx((here.support(phi + d).h_phi - here.support(phi - d).h_phi) / (2 * d)).margin(1e-5));
      CHECK(s.h_x == Approx((after.support(phi).h - before.support(phi).h) / (2 * d)).margin(1e-6));
      CHECK(s.h_xphi == Approx((after.support(phi).h_phi - before.support(phi).h_phi) / (2 * d)).margin(1e-5));
    }
    CHECK((here.center_dx - (after.center - before.center) / (2 * d)).norm() < 1e-7);
  }
}

TEST_CASE("forging body: the mean width of a section is its boundary's length over pi") {
  // Cauchy's theorem for convex curves, from points instead of the support function.
  const ForgingBody body = body_of(stepped_scene());
  for (const double x : {0.0, 310.0, 950.0, 1900.0}) {
    const SectionShape section = body.section(x);
    constexpr int count = 20000;  // chords miss 1e-8 of the length
    double length = 0.0;
    for (int i = 0; i < count; ++i) {
      const double step = 2.0 * std::numbers::pi / count;
      length += (section.boundary((i + 1) * step) - section.boundary(i * step)).norm();
    }
    CHECK(section_truth(section).diameter_mm == Approx(length / std::numbers::pi).margin(1e-4));
  }
}

TEST_CASE("forging body: a square of 300 mm is so wide across its faces, in whatever way it is turned") {
  for (const int faces : {4, 8}) {
    ForgingScene scene = bar_scene(faces);
    const ForgingBody body = body_of(scene, 3);
    constexpr double pi = std::numbers::pi;
    for (const double x : {0.0, 700.0, 1900.0}) {
      const SectionShape section = body.section(x);
      const SectionTruth truth = section_truth(section);
      REQUIRE(truth.widths_mm.size() == static_cast<std::size_t>(faces / 2));
      for (const double width : truth.widths_mm) CHECK(width == Approx(300.0).margin(1e-6));
      // Corner to corner: the sharp polygon's, less what two arcs of 25 mm cut off.
      const double half = pi / faces, diagonal = (300.0 - 2.0 * 25.1) / std::cos(half) + 2.0 * 25.0;
      CHECK(truth.circularity_mm == Approx(0.5 * (diagonal - 300.0)).margin(0.01));  // nearest of half degrees
      // Faces, and arcs that make one turn together, all of it a bulge of 0.1 mm longer at most.
      const double girth = faces * (300.0 - 2.0 * 25.1) * std::tan(half) + 2.0 * pi * 25.0;
      CHECK(truth.diameter_mm == Approx(girth / pi).margin(0.05));
      CHECK((truth.center_mm - section.center).norm() < 0.01);  // a regular polygon is its centre's mirror image
    }
  }
}

TEST_CASE("forging body: the support function of a section with faces has its derivatives, steps and bow included") {
  ForgingScene scene = bar_scene(4);
  scene.stations = {{0.0, 300.0}, {900.0, 260.0}};
  scene.face_bulge_mm = 2.0;  // soft enough for differences
  scene.circularity_mm = 1.0;
  const ForgingBody body = body_of(scene);
  constexpr double d = 1e-6;
  for (const double x : {100.0, 890.0, 905.0}) {
    const SectionShape here = body.section(x), before = body.section(x - d), after = body.section(x + d);
    for (double phi = 0.1; phi < 6.2; phi += 0.05) {
      const auto s = here.support(phi), ahead = here.support(phi + d), behind = here.support(phi - d);
      CHECK(s.h_phi == Approx((ahead.h - behind.h) / (2 * d)).margin(1e-4));
      CHECK(s.h_phiphi == Approx((ahead.h_phi - behind.h_phi) / (2 * d)).margin(1e-3));
      CHECK(s.h_x == Approx((after.support(phi).h - before.support(phi).h) / (2 * d)).margin(1e-5));
      CHECK(s.h_xphi == Approx((after.support(phi).h_phi - before.support(phi).h_phi) / (2 * d)).margin(1e-3));
    }
  }
}

TEST_CASE("forging body: circularity and bow are those of the scene") {
  ForgingScene scene = stepped_scene();
  scene.press_marks = 0;
  scene.eccentricity_mm = 0.0;
  scene.kink_mm = 0.0;
  const ForgingBody body = body_of(scene);
  double circularity = 0.0, deflection = 0.0;
  for (double x = 0.0; x <= 1900.0; x += 5.0) {
    const SectionTruth truth = section_truth(body.section(x));
    circularity = std::max(circularity, truth.circularity_mm);
    deflection = std::max(deflection, truth.center_mm.norm());
  }
  CHECK(circularity == Approx(scene.circularity_mm).margin(0.02));  // its worst section may lie between two of ours
  CHECK(deflection == Approx(scene.bow_mm).margin(0.12 * scene.bow_mm));  // the ideal axis rises a little into the bow
}

TEST_CASE("forging body: its x axis is the least-squares line through both end sections") {
  const ForgingBody body = body_of(stepped_scene());
  double n = 0, sx = 0, sxx = 0;
  Eigen::Vector2d sy = Eigen::Vector2d::Zero(), sxy = Eigen::Vector2d::Zero();
  for (int i = 0; i <= 160; ++i) {
    for (const double x : {0.5 * i, 1900.0 - 0.5 * i}) {
      const Eigen::Vector2d center = section_truth(body.section(x)).center_mm;
      n += 1;
      sx += x;
      sxx += x * x;
      sy += center;
      sxy += x * center;
    }
  }
  const Eigen::Vector2d slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  CHECK(slope.norm() < 1e-7);
  CHECK(((sy - slope * sx) / n).norm() < 1e-4);  // the sections' ends may be sampled otherwise
}

TEST_CASE("forging body: one seed gives one body, another seed another") {
  const ForgingScene scene = stepped_scene();
  const auto a = body_of(scene, 1).section(700.0), b = body_of(scene, 1).section(700.0),
             c = body_of(scene, 2).section(700.0);
  CHECK(a.support(1.0).h == b.support(1.0).h);
  CHECK(a.support(1.0).h != c.support(1.0).h);
}

TEST_CASE("forging body: sections that would not be convex are refused by position") {
  ForgingScene scene = stepped_scene();
  scene.circularity_mm = 60.0;
  const auto body = ForgingBody::make(scene, end_section_mm, 1);
  REQUIRE_FALSE(body);
  CHECK(body.error().kind == ErrorKind::invalid_input);
  CHECK_THAT(body.error().message, Catch::Contains("not convex") && Catch::Contains("circularity_mm"));
}

}  // namespace imprint
