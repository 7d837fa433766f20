#include "survey/survey.h"

#include <algorithm>

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "lib/geometry/rotation.h"
#include "tests/unit/survey/photographed_field.h"

namespace imprint {
namespace {

// Small enough for many repetitions: 16 targets and the bars' ends.
PhotographedField small_field(std::mt19937& random) { return large_field(16, 14, random); }

bool mentions(const Error& error, const std::string& text) { return error.message.find(text) != std::string::npos; }

// One of the photographs, its targets as a lens of another focal length shows them.
void zoom(SurveyPhoto& photo, const CameraModel& camera, double factor) {
  for (DetectedTarget& target : photo.targets) {
    target.center.x_px = camera.principal_point.x_px + factor * (target.center.x_px - camera.principal_point.x_px);
    target.center.y_px = camera.principal_point.y_px + factor * (target.center.y_px - camera.principal_point.y_px);
  }
}

}  // namespace

TEST_CASE("survey: 60 photographs of 6 x 6 x 2 m, the camera unknown, give the targets to less than 0.06 mm") {
  std::mt19937 random(1);
  const auto field = large_field(40, 60, random);
  const auto survey = survey_field(input_of(field, random), SurveyConfig{});
  REQUIRE(survey.has_value());
  CHECK(survey->targets.size() == 43);  // one lies so that fewer than two photographs can read it
  CHECK(survey->seen_once.size() <= 1);
  CHECK(rms_after_fit(field, *survey) < 0.06);  // 0.02 px are 0.025 mm at 5.5 m; the bars' 0.01 mm add to it
  CHECK(survey->camera.focal_length_px == Approx(field.camera.focal_length_px).margin(0.6));
  CHECK(survey->reprojection_rms_px < 0.03);  // the length of two components of 0.02 px
  CHECK(survey->rejected.size() < 15);        // of about 1,440, beyond 4.5 sigma
  for (const SurveyBar& bar : survey->bars) CHECK(std::abs(bar.measured_mm - bar.bar.length_mm) < 0.04);
}

TEST_CASE("survey: a flat wall, on which two photographs have two answers, is solved") {
  for (const unsigned seed : {1U, 2U}) {
    std::mt19937 random(seed);
    const auto field = flat_field(24, 14, random);
    const auto survey = survey_field(input_of(field, random), SurveyConfig{});
    REQUIRE(survey.has_value());
    CHECK(survey->targets.size() == 28);
    CHECK(rms_after_fit(field, *survey) < 0.06);
  }
}

TEST_CASE("survey: the stated sigma is the spread of repetitions") {
  double squares = 0.0, stated = 0.0;
  int targets = 0, beyond = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    const auto field = small_field(random);
    auto input = input_of(field, random);
    std::normal_distribution<double> of_bar(0.0, 0.01);
    for (ScaleBar& bar : input.bars) bar.length_mm += of_bar(random);
    input.camera.focal_length_px = 4364.0;
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE(survey.has_value());
    std::vector<Eigen::Vector3d> from, to;
    for (const auto& [id, target] : survey->targets) {
      from.push_back(target.p_world_mm);
      to.push_back(field.targets.at(id).p_mm);
    }
    // The free network's own frame is the one that fits the truth best.
    const Similarity fit = fit_points(from, to, false);
    for (const auto& [id, target] : survey->targets) {
      const Eigen::Vector3d error = fit.R.transpose() * (field.targets.at(id).p_mm - fit(target.p_world_mm));
      squares += error.dot(target.covariance.ldlt().solve(error));
      stated += 3.0;
      ++targets;
      beyond += error.norm() > 1.96 * std::sqrt(3.0) * target.sigma_mm() ? 1 : 0;
    }
  }
  // Normalised squares have the mean 1 where the covariance is right; targets of one network go together, so that 20
  // networks tell it to about 10 %.
  CHECK(squares / stated == Approx(1.0).margin(0.25));
  CHECK(beyond < 0.05 * targets);
}

TEST_CASE("survey: wrong ids are left out and named, and change nothing") {
  std::mt19937 random(3);
  const auto field = large_field(30, 20, random);
  auto input = input_of(field, random);
  const auto clean = survey_field(input, SurveyConfig{});
  REQUIRE(clean.has_value());
  int swapped = 0;
  for (SurveyPhoto& photo : input.photos) {
    std::shuffle(photo.targets.begin(), photo.targets.end(), random);
    if (photo.targets.size() < 8) continue;
    std::swap(photo.targets[0].id, photo.targets[1].id);
    swapped += 2;
  }
  const auto survey = survey_field(input, SurveyConfig{});
  REQUIRE(survey.has_value());
  CHECK(static_cast<int>(survey->rejected.size()) >= swapped);
  CHECK(static_cast<int>(survey->rejected.size()) <= swapped + static_cast<int>(clean->rejected.size()) + 6);
  for (const auto& [id, target] : survey->targets) {
    const SurveyTarget& before = clean->targets.at(id);
    CHECK((target.p_world_mm - before.p_world_mm).norm() < 4.0 * std::sqrt(3.0) * target.sigma_mm());
  }
}

TEST_CASE("survey: large dots seen aslant are not measured beside their centres") {
  std::mt19937 random(5);
  auto field = large_field(24, 14, random);
  field.dot_radius_mm = 60.0;
  field.noise_px = 0.002;
  const auto input = input_of(field, random);
  SurveyConfig config;
  const auto corrected = survey_field(input, config);
  config.correct_eccentricity = false;
  const auto as_seen = survey_field(input, config);
  REQUIRE(corrected.has_value());
  REQUIRE(as_seen.has_value());
  // 0.002 px would leave 0.01 to 0.02 mm; what is more comes of the tilts, found to about a degree.
  CHECK(rms_after_fit(field, *corrected) < 0.5 * rms_after_fit(field, *as_seen));
  CHECK(corrected->reprojection_rms_px < 0.4 * as_seen->reprojection_rms_px);
}

TEST_CASE("survey: targets with few or narrow rays are reported, those seen once are not made up") {
  std::mt19937 random(6);
  const auto field = large_field(30, 20, random);
  auto input = input_of(field, random);
  std::map<int, int> left;
  const int rare = input.photos[0].targets[3].id, once = input.photos[0].targets[5].id;
  for (SurveyPhoto& photo : input.photos)
    std::erase_if(photo.targets, [&](const DetectedTarget& t) {
      return (t.id == rare && ++left[rare] > 2) || (t.id == once && ++left[once] > 1);
    });
  const auto survey = survey_field(input, SurveyConfig{});
  REQUIRE(survey.has_value());
  CHECK(survey->targets.count(once) == 0);
  CHECK(std::count(survey->seen_once.begin(), survey->seen_once.end(), once) == 1);
  if (survey->targets.count(rare) > 0) CHECK_FALSE(survey->targets.at(rare).needs.empty());
  CHECK(std::count_if(survey->targets.begin(), survey->targets.end(),
                      [](const auto& entry) { return entry.second.needs.empty(); }) > 20);
}

TEST_CASE("survey: two parts that nothing joins are named") {
  std::mt19937 random(7);
  auto here = flat_field(16, 8, random), there = flat_field(16, 6, random);
  auto input = input_of(here, random);
  for (SurveyPhoto& photo : photograph(there, random)) {
    photo.name = "other " + photo.name;
    for (DetectedTarget& target : photo.targets) target.id += 200;
    input.photos.push_back(std::move(photo));
  }
  const auto survey = survey_field(input, SurveyConfig{});
  REQUIRE_FALSE(survey.has_value());
  CHECK(mentions(survey.error(), "not connected"));
  CHECK(mentions(survey.error(), "other photo"));
  CHECK(mentions(survey.error(), "201"));
}

TEST_CASE("survey: bars that disagree, bars out of sight, and photographs of two cameras are refused with the reason") {
  std::mt19937 random(8);
  const auto field = small_field(random);
  auto input = input_of(field, random);
  input.camera.focal_length_px = 4364.0;
  SECTION("two bars that disagree by 1 mm") {
    input.bars[1].length_mm += 1.0;
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE_FALSE(survey.has_value());
    CHECK(mentions(survey.error(), "disagree"));
    CHECK(survey.error().exit_status() == 1);
  }
  SECTION("of three bars the wrong one is named") {
    input.bars.push_back({1, 3, (field.targets.at(1).p_mm - field.targets.at(3).p_mm).norm() + 1.0, 0.01});
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE_FALSE(survey.has_value());
    CHECK(mentions(survey.error(), "the scale bar from 1 to 3 disagrees"));
  }
  SECTION("no bar in sight") {
    input.bars = {{301, 302, 1000.0, 0.01}};
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE_FALSE(survey.has_value());
    CHECK(mentions(survey.error(), "no scale bar"));
    CHECK(mentions(survey.error(), "301"));
  }
  SECTION("a third of the photographs with 3 % more focal length") {
    for (std::size_t k = 0; k < input.photos.size(); k += 3) zoom(input.photos[k], field.camera, 1.03);
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE_FALSE(survey.has_value());
    CHECK(mentions(survey.error(), "another camera"));
    CHECK(mentions(survey.error(), "photo0"));
    CHECK_FALSE(mentions(survey.error(), "photo1,"));
  }
  SECTION("a focal length stated half as long") {
    input.camera.focal_length_px = 2300.0;
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE_FALSE(survey.has_value());
  }
}

TEST_CASE("survey: the frame is the one asked for") {
  std::mt19937 random(9);
  const auto field = small_field(random);
  auto input = input_of(field, random);
  input.camera.focal_length_px = 4364.0;
  const auto free = survey_field(input, SurveyConfig{});
  REQUIRE(free.has_value());
  std::vector<int> ids;
  for (const auto& [id, target] : free->targets) ids.push_back(id);
  const int a = ids[0], b = ids[1], c = ids[2];
  SECTION("three targets") {
    input.datum = {a, b, c, std::nullopt};
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE(survey.has_value());
    CHECK(survey->targets.at(a).p_world_mm.norm() < 1e-6);
    CHECK(survey->targets.at(b).p_world_mm.tail<2>().norm() < 1e-6);
    CHECK(std::abs(survey->targets.at(c).p_world_mm.z()) < 1e-6);
    CHECK(survey->targets.at(c).p_world_mm.y() > 0.0);
    CHECK(survey->targets.at(b).sigma_mm() == Approx(free->targets.at(b).sigma_mm()).epsilon(1e-3));
  }
  SECTION("the frame of coordinates that are known roughly") {
    TargetField nominal;
    for (const int id : ids) nominal.targets[id].p_world_mm = field.targets.at(id).p_mm + Eigen::Vector3d(3, -2, 1);
    input.datum.align = nominal;
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE(survey.has_value());
    CHECK((survey->targets.at(a).p_world_mm - nominal.targets.at(a).p_world_mm).norm() < 1.0);
    CHECK(survey->datum.align_rms_mm.value() < 0.5);
  }
  SECTION("a target that is not there") {
    input.datum = {a, b, 999, std::nullopt};
    const auto survey = survey_field(input, SurveyConfig{});
    REQUIRE_FALSE(survey.has_value());
    CHECK(mentions(survey.error(), "--plane 999"));
  }
}

}  // namespace imprint
