#include "fusion/faceted/corner_model.h"

#include <cmath>
#include <random>

#include <catch2/catch.hpp>

#include "fusion/faceted/section_evidence.h"

namespace imprint {
namespace {

CornerModel rectangle(double width, double height, double radius, double turn_deg = 0.0) {
  CornerModel section;
  section.radius_mm = radius;
  section.corners_mm.resize(2, 4);
  const double a = 0.5 * width - radius, b = 0.5 * height - radius;
  section.corners_mm << a, -a, -a, a, b, b, -b, -b;
  const double turn = turn_deg * M_PI / 180.0;
  Eigen::Matrix2d R;
  R << std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn);
  section.corners_mm = R * section.corners_mm;
  return section;
}

std::vector<SupportSample> samples_of(const CornerModel& section, double noise, int count = 720) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0.0, noise);
  std::vector<SupportSample> samples;
  for (int i = 0; i < count; ++i) {
    const double theta = 2.0 * M_PI * i / count;
    const Eigen::Vector2d n(std::cos(theta), std::sin(theta));
    samples.push_back({n, section.support(n) + (noise > 0.0 ? normal(generator) : 0.0)});
  }
  return samples;
}

}  // namespace

TEST_CASE("corner model: measures of a rectangle are those one would write on its drawing") {
  const Eigen::VectorXd m = measures_of(rectangle(300.0, 240.0, 20.0, 7.0), SectionKind::rectangle);
  // Faces follow each other from the first corner on: first across the height, then across the width.
  CHECK(m(kWidths) == Approx(240.0));
  CHECK(m(kWidths + 1) == Approx(300.0));
  CHECK(m(kCornerRadius) == Approx(20.0));
  CHECK(std::abs(m(kSquareness)) < 1e-9);
  // Mean width is the circumference over pi (Cauchy); 180 directions miss the corners by less than 1e-4.
  CHECK(m(kMeanWidth) == Approx((2.0 * (260.0 + 200.0) + 2.0 * M_PI * 20.0) / M_PI).epsilon(1e-4));
  CHECK(m(kCircularity) == Approx(0.5 * (std::hypot(260.0, 200.0) + 40.0 - 240.0)).epsilon(1e-3));
  const double turned = measures_of(rectangle(300.0, 240.0, 20.0, 19.0), SectionKind::rectangle)(kDirection);
  CHECK((turned - m(kDirection)) * 180.0 / M_PI == Approx(12.0));
}

TEST_CASE("corner model: a section is found from its tangents, however it is turned") {
  for (const double turn : {0.0, 20.0, 44.0, 70.0}) {
    const CornerModel truth = rectangle(2.0, 1.6, 0.2, turn);
    const CornerFit fit = fit_corners(samples_of(truth, 1e-3), 4);
    CHECK(fit.scatter < 1.5e-3);
    const Eigen::VectorXd m = measures_of(fit.section, SectionKind::rectangle);
    CHECK(std::max(m(kWidths), m(kWidths + 1)) == Approx(2.0).margin(2e-3));
    CHECK(std::min(m(kWidths), m(kWidths + 1)) == Approx(1.6).margin(2e-3));
    CHECK(m(kCornerRadius) == Approx(0.2).margin(5e-3));
  }
}

TEST_CASE("corner model: the kind of section is the one the tangents speak for") {
  CHECK(find_section(samples_of(rectangle(2.0, 2.0, 0.2, 9.0), 1e-3), SectionKind::unknown).kind ==
        SectionKind::square);
  CHECK(find_section(samples_of(rectangle(2.0, 1.6, 0.2, 9.0), 1e-3), SectionKind::unknown).kind ==
        SectionKind::rectangle);
  CornerModel octagon;
  octagon.radius_mm = 0.1;
  octagon.corners_mm.resize(2, 8);
  for (int i = 0; i < 8; ++i)
    octagon.corners_mm.col(i) = Eigen::Vector2d(std::cos(0.3 + i * M_PI / 4), std::sin(0.3 + i * M_PI / 4));
  CHECK(find_section(samples_of(octagon, 1e-3), SectionKind::unknown).kind == SectionKind::octagon);
  // An oval as a round forging may be: no faces.
  std::vector<SupportSample> oval;
  for (int i = 0; i < 720; ++i) {
    const double theta = 2.0 * M_PI * i / 720;
    oval.push_back({{std::cos(theta), std::sin(theta)}, 1.0 + 0.03 * std::cos(2.0 * theta + 0.4)});
  }
  CHECK(find_section(oval, SectionKind::unknown).kind == SectionKind::round);
  // What the rig says has the last word.
  CHECK(find_section(samples_of(octagon, 1e-3), SectionKind::rectangle).kind == SectionKind::rectangle);
  CHECK(find_section(samples_of(octagon, 1e-3), SectionKind::round).kind == SectionKind::round);
}

TEST_CASE("corner model: a family is what its regular polygon can be made by stretching, shearing and turning") {
  const FamilyProjections family = family_projections(4);
  const auto stacked = [](const CornerModel& section) {
    Eigen::VectorXd corners(8);
    for (int i = 0; i < 4; ++i) corners.segment<2>(2 * i) = section.corners_mm.col(i);
    return corners;
  };
  const Eigen::VectorXd square = stacked(rectangle(2.0, 2.0, 0.0, 33.0)),
                        oblong = stacked(rectangle(2.0, 1.0, 0.0, 33.0));
  CHECK((family.not_affine * oblong).norm() < 1e-9);
  CHECK((family.affine_not_similar * square).norm() < 1e-9);
  CHECK((family.affine_not_similar * oblong).norm() > 0.1);
  Eigen::VectorXd kite = square;
  kite(0) += 0.3;
  CHECK((family.not_affine * kite).norm() > 0.1);
}

}  // namespace imprint
