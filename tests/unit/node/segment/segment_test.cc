#include "node/segment/segment.h"

#include <cmath>
#include <numbers>
#include <random>

#include <catch2/catch.hpp>
#include <opencv2/imgproc.hpp>

#include "node/segment/segment_config.h"
#include "node/segment/segment_prior.h"
#include "tests/unit/node/segment/drawn_forging.h"

namespace imprint {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const cv::Size kSize(900, 600);

drawn::Body plain_body() {
  drawn::Body body;
  body.origin = {450, 300};
  body.start_px = -300, body.end_px = 300;
  return body;
}

SegmentPrior prior(double direction_deg = 0) {
  SegmentPrior p;
  p.direction_x = std::cos(direction_deg * kDegree), p.direction_y = std::sin(direction_deg * kDegree);
  p.diameter_min_px = 60, p.diameter_max_px = 180;
  return p;
}

// Largest distance of the expected rims from the drawn ones, ends left out by `margin` stations.
double worst_rim_error(const Segmentation& found, const drawn::Body& body, double margin = 15) {
  double worst = 0;
  const double nx = -found.direction_y, ny = found.direction_x;
  for (std::size_t i = 0; i < found.upper_offset_px.size(); ++i) {
    const double station = found.first_station_px + static_cast<double>(i);
    for (const bool upper : {true, false}) {
      const double offset = upper ? found.upper_offset_px[i] : found.lower_offset_px[i];
      if (std::isnan(offset)) continue;
      const cv::Vec2d p = body.along_and_across(found.origin.x_px + station * found.direction_x + offset * nx,
                                                found.origin.y_px + station * found.direction_y + offset * ny);
      if (p[0] < body.start_px + margin || p[0] > body.end_px - margin) continue;
      const double across = std::abs(p[1] - body.middle_px(p[0]));
      worst = std::max(worst, std::abs(across - body.half_width_px(p[0])));
    }
  }
  return worst;
}

double length_px(const Segmentation& found) { return static_cast<double>(found.upper_offset_px.size()); }

}  // namespace

TEST_CASE("segment: a glowing body is found with both rims and its extent") {
  const drawn::Body body = plain_body();
  const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 1), prior(), {});
  REQUIRE(found);
  CHECK(worst_rim_error(*found, body) < 3);  // the image is reduced by 3
  CHECK(std::abs(length_px(*found) - 600) < 24);
  CHECK(found->score > 0.7);  // all proven; its length of six widths counts 0.8
  CHECK(found->others.empty());
  CHECK(found->direction_x > 0.999);
}

TEST_CASE("segment: any orientation, both senses of the prior's direction") {
  for (const double angle : {30.0, 90.0, 137.0, 180.0, -60.0}) {
    drawn::Body body = plain_body();
    body.tilt_rad = angle * kDegree;
    body.start_px = -230, body.end_px = 200;
    const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 2), prior(angle), {});
    INFO("angle " << angle);
    REQUIRE(found);
    CHECK(worst_rim_error(*found, body) < 4);
    CHECK(found->direction_x * std::cos(body.tilt_rad) + found->direction_y * std::sin(body.tilt_rad) > 0.999);
    CHECK(found->upper_offset_px[50] < found->lower_offset_px[50]);
  }
}

TEST_CASE("segment: tilted against the prior by up to 30 degrees") {
  for (const double tilt : {-30.0, -21.0, -8.0, 3.0, 12.0, 16.0, 30.0}) {
    drawn::Body body = plain_body();
    body.tilt_rad = tilt * kDegree;
    const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 3), prior(), {});
    INFO("tilt " << tilt);
    REQUIRE(found);
    CHECK(worst_rim_error(*found, body) < 4);
    CHECK(std::abs(length_px(*found) - 600) < 30);
  }
}

TEST_CASE("segment: dark on bright, 16 bit, low contrast and saturation") {
  drawn::Body body = plain_body();
  SegmentPrior p = prior();
  SECTION("dark on bright") {
    body.level = 40, body.background = 220;
    p.polarity = Polarity::dark;
    const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 4), p, {});
    REQUIRE(found);
    CHECK(worst_rim_error(*found, body) < 3);
  }
  SECTION("25 grey levels of 255, noise 3") {
    body.level = 55;
    const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 5), p, {});
    REQUIRE(found);
    CHECK(worst_rim_error(*found, body) < 4);
  }
  SECTION("16 bit, a twentieth of its range") {
    body.level = 14, body.background = 2;
    const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 0.5, 6, CV_16U), p, {});
    REQUIRE(found);
    CHECK(worst_rim_error(*found, body) < 3);
  }
  SECTION("saturated") {
    body.level = 600;
    const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 7), p, {});
    REQUIRE(found);
    CHECK(worst_rim_error(*found, body) < 4);
  }
}

TEST_CASE("segment: steps of the diameter are followed") {
  drawn::Body body = plain_body();
  body.half_width_px = [](double s) { return s < -100 ? 38.0 : s < 120 ? 75.0 : 45.0; };
  const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 8), prior(), {});
  REQUIRE(found);
  int wrong = 0;
  for (std::size_t i = 0; i < found->upper_offset_px.size(); ++i) {
    const double station = found->first_station_px + static_cast<double>(i) + found->origin.x_px - body.origin.x_px;
    if (std::abs(station + 100) < 10 || std::abs(station - 120) < 10 || std::abs(station) > 285) continue;
    wrong += std::abs(0.5 * (found->lower_offset_px[i] - found->upper_offset_px[i]) - body.half_width_px(station)) > 3;
  }
  CHECK(wrong == 0);
  CHECK(std::abs(length_px(*found) - 600) < 24);
}

TEST_CASE("segment: scale that interrupts the rims does not end the body") {
  drawn::Body body = plain_body();
  body.patches = {{-120, -60, true, 20, 32}, {-20, 30, false, 25, 32}, {100, 150, true, 15, 60}};
  const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 9), prior(), {});
  REQUIRE(found);
  CHECK(std::abs(length_px(*found) - 600) < 24);
}

TEST_CASE("segment: brighter beams, plates and lamps do not win") {
  drawn::Body body = plain_body();
  body.origin = {450, 330};
  body.level = 110;
  cv::Mat_<float> image = drawn::draw(body, kSize);
  drawn::draw_bar(image, {0, 20, 900, 30}, 250);   // a beam narrower than the range
  drawn::draw_bar(image, {0, 100, 900, 22}, 240);  // two beams as far apart as a forging is wide
  drawn::draw_bar(image, {0, 200, 900, 22}, 240);
  drawn::draw_bar(image, {30, 420, 100, 100}, 255);  // plates with black middles
  drawn::draw_bar(image, {50, 440, 60, 60}, 5);
  drawn::draw_bar(image, {700, 430, 110, 90}, 255);
  drawn::draw_bar(image, {850, 0, 20, 600}, 230);  // an upright
  cv::circle(image, {300, 500}, 40, cv::Scalar(255), -1);
  const auto found = segment_forging(drawn::expose(image, 3, 10), prior(), {});
  REQUIRE(found);
  CHECK(worst_rim_error(*found, body) < 4);
}

TEST_CASE("segment: a body that is wider than the rig allows is not taken") {
  drawn::Body body = plain_body();
  body.half_width_px = [](double) { return 50.0; };
  cv::Mat_<float> image = drawn::draw(body, kSize);
  drawn::draw_bar(image, {0, 380, 900, 215}, 240);
  const auto found = segment_forging(drawn::expose(image, 3, 11), prior(), {});
  REQUIRE(found);
  CHECK(worst_rim_error(*found, body) < 4);
}

TEST_CASE("segment: of several hot bodies the one of the rig's width is taken and the others are named") {
  drawn::Body body = plain_body();
  body.origin = {450, 330};
  cv::Mat_<float> image = drawn::draw(body, kSize);
  drawn::draw_bar(image, {40, 20, 560, 200}, 170);   // wider than any diameter of the rig
  drawn::draw_bar(image, {100, 500, 700, 45}, 150);  // narrower
  drawn::draw_bar(image, {700, 40, 110, 100}, 150);  // of a width that fits, but no longer than wide
  const auto found = segment_forging(drawn::expose(image, 3, 21), prior(), {});
  REQUIRE(found);
  CHECK(worst_rim_error(*found, body) < 4);
  REQUIRE(found->others.size() == 3);  // the largest first
  CHECK(found->others[0].why_not.find("wider") != std::string::npos);
  CHECK(found->others[0].middle.x_px == Approx(319.5).margin(4));
  CHECK(found->others[0].middle.y_px == Approx(119.5).margin(4));
  CHECK(found->others[0].width_px == Approx(200).margin(10));
  CHECK(found->others[1].why_not.find("narrower") != std::string::npos);
  CHECK(found->others[2].why_not.find("short") != std::string::npos);
}

TEST_CASE("segment: a jaw that holds an end, darker or as bright as the body, is left out") {
  for (const float level : {60.0F, 150.0F}) {
    drawn::Body body = plain_body();
    cv::Mat_<float> image = drawn::draw(body, kSize);
    drawn::draw_bar(image, {650, 190, 250, 220}, level);  // twice as wide, from station 200 on
    const auto found = segment_forging(drawn::expose(image, 3, 22), prior(), {});
    INFO("level " << level);
    REQUIRE(found);
    const double last = found->origin.x_px + found->direction_x * (found->first_station_px + length_px(*found) - 1);
    CHECK(last == Approx(650).margin(30));  // the edge stage looks half a width about it
  }
}

TEST_CASE("segment: a jaw a little darker than the body ends it, though its arm is as wide and in line") {
  const drawn::Body body = plain_body();
  cv::Mat_<float> image = drawn::draw(body, kSize);
  drawn::draw_bar(image, {650, 215, 60, 170}, 128);
  drawn::draw_bar(image, {710, 256, 190, 88}, 124);
  const auto found = segment_forging(drawn::expose(image, 3, 26), prior(), {});
  REQUIRE(found);
  const double last = found->origin.x_px + found->direction_x * (found->first_station_px + length_px(*found) - 1);
  CHECK(last == Approx(650).margin(30));
}

TEST_CASE("segment: a body goes on behind scale that covers a whole section near its end") {
  drawn::Body body = plain_body();
  body.patches = {
      {200, 255, true, 50, 30}, {200, 255, false, 50, 30}, {-40, 10, true, 40, 30}, {60, 90, false, 60, 30}};
  const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 27), prior(), {});
  REQUIRE(found);
  const double last = found->origin.x_px + found->direction_x * (found->first_station_px + length_px(*found) - 1);
  CHECK(last == Approx(750).margin(30));
}

TEST_CASE("segment: clutter that outshines and touches the body does not bend its rims") {
  drawn::Body body = plain_body();
  body.level = 60;
  cv::Mat_<float> image = drawn::draw(body, kSize);
  drawn::draw_bar(image, {260, 60, 30, 190}, 240);   // stands on the upper rim
  drawn::draw_bar(image, {600, 350, 40, 200}, 200);  // hangs on the lower rim
  drawn::draw_bar(image, {400, 351, 120, 60}, 250);  // a window along it
  const auto found = segment_forging(drawn::expose(image, 3, 23), prior(), {});
  REQUIRE(found);
  CHECK(worst_rim_error(*found, body) < 8);  // some px are left to the search about the rim
  CHECK(std::abs(length_px(*found) - 600) < 24);
}

TEST_CASE("segment: a rim under scale keeps the distance of the clean rim across") {
  drawn::Body body = plain_body();
  body.patches = {{-150, 50, false, 30, 30}, {120, 220, true, 25, 25}};
  const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 24), prior(), {});
  REQUIRE(found);
  CHECK(worst_rim_error(*found, body) < 10);  // the search about the rim reaches farther
}

TEST_CASE("segment: a clean body ends before a plate or a grille as bright as itself") {
  for (const bool grille : {false, true}) {
    const drawn::Body body = plain_body();
    cv::Mat_<float> image = drawn::draw(body, kSize);
    if (grille)
      for (int y = 210; y < 400; y += 24) drawn::draw_bar(image, {752, y, 148, 12}, 150);
    else
      drawn::draw_bar(image, {768, 240, 100, 140}, 150);
    const auto found = segment_forging(drawn::expose(image, 3, 25), prior(), {});
    INFO((grille ? "grille" : "plate"));
    REQUIRE(found);
    const double last = found->origin.x_px + found->direction_x * (found->first_station_px + length_px(*found) - 1);
    CHECK(last == Approx(750).margin(30));
  }
}

TEST_CASE("segment: a hall full of edges does not hide a faint body") {
  drawn::Body body = plain_body();
  body.background = 40, body.level = 60;
  cv::Mat_<float> hall(kSize, 40.0F);
  std::mt19937 random(26);
  const auto draw = [&](int least, int most) { return std::uniform_int_distribution(least, most)(random); };
  for (int i = 0; i < 900; ++i)
    drawn::draw_bar(hall, {draw(-20, 880), draw(-20, 580), draw(8, 60), draw(4, 30)}, static_cast<float>(draw(25, 55)));
  cv::Mat_<float> image = drawn::draw(body, kSize);
  for (int y = 0; y < kSize.height; ++y)
    for (int x = 0; x < kSize.width; ++x)
      if (image(y, x) < 41) image(y, x) = hall(y, x);
  const auto found = segment_forging(drawn::expose(image, 0.8, 27), prior(), {});
  REQUIRE(found);
  CHECK(worst_rim_error(*found, body) < 6);
}

TEST_CASE("segment: out of view on one side") {
  drawn::Body body = plain_body();
  body.end_px = 700;
  const auto found = segment_forging(drawn::expose(drawn::draw(body, kSize), 3, 12), prior(), {});
  REQUIRE(found);
  CHECK(worst_rim_error(*found, body) < 3);
  CHECK(found->origin.x_px + found->first_station_px + length_px(*found) > 870);
}

TEST_CASE("segment: no forging is an error that says what was missing") {
  const auto message = [](const cv::Mat& image) {
    const auto found = segment_forging(image, prior(), {});
    REQUIRE_FALSE(found);
    CHECK(found.error().kind == ErrorKind::job_failed);
    return found.error().message;
  };
  CHECK(message(cv::Mat::zeros(kSize, CV_8U)).find("no edge") != std::string::npos);
  CHECK(message(cv::Mat(kSize, CV_8U, cv::Scalar(255))).find("no edge") != std::string::npos);
  CHECK(message(cv::Mat(kSize, CV_16U, cv::Scalar(65535))).find("no edge") != std::string::npos);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    CHECK_FALSE(message(drawn::expose(cv::Mat_<float>(kSize, 20.0F), 3, seed)).empty());
    cv::Mat_<float> hall(kSize, 20.0F);
    drawn::draw_bar(hall, {0, 60, 900, 30}, 200);
    drawn::draw_bar(hall, {0, 300, 900, 20}, 120);
    drawn::draw_bar(hall, {200, 330, 100, 110}, 255);
    drawn::draw_bar(hall, {600, 350, 120, 100}, 255);
    CHECK_FALSE(message(drawn::expose(hall, 3, seed)).empty());
  }
  cv::Mat_<float> bars(kSize, 20.0F);  // a grating as wide and long as a forging
  for (int k = 0; k < 6; ++k) drawn::draw_bar(bars, {200, 250 + 18 * k, 500, 9}, 200);
  CHECK(message(drawn::expose(bars, 3, 30)).find("score") != std::string::npos);
}

TEST_CASE("segment: the prior follows rig and pose") {
  CameraModel camera;
  camera.id = "cam1", camera.width_px = 4656, camera.height_px = 3520, camera.focal_length_px = 5000;
  camera.principal_point = {2327.5, 1759.5};
  ForgingSpec forging;
  forging.diameter_min_mm = 150, forging.diameter_max_mm = 300;
  forging.axis_direction_world = {std::cos(0.3), std::sin(0.3), 0};
  TargetField field;
  for (int i = 0; i < 9; ++i) field.targets[i + 1].p_world_mm = {300.0 * (i % 3), 200.0 * (i / 3), 100.0 * i};
  CameraPose pose;
  pose.center_world_mm = {300, 200, -4600};  // the middle target stands at 400: 5000 mm away
  const auto given = make_segment_prior(camera, pose, forging, field);
  REQUIRE(given);
  const SegmentPrior& p = *given;
  CHECK(std::atan2(p.direction_y, p.direction_x) == Approx(0.3));
  CHECK(p.diameter_min_px == Approx(100));
  CHECK(p.diameter_max_px == Approx(500));

  forging.axis_direction_world = {0, 0.1, 0.995};
  const auto along = make_segment_prior(camera, pose, forging, field);
  REQUIRE_FALSE(along);
  CHECK(along.error().kind == ErrorKind::job_failed);
  pose.center_world_mm.z() = 9000;
  const auto behind = make_segment_prior(camera, pose, forging, field);
  REQUIRE_FALSE(behind);
  CHECK(behind.error().message.find("cam1") != std::string::npos);
}

TEST_CASE("segment: unusable input is refused") {
  CHECK(segment_forging(cv::Mat(), prior(), {}).error().kind == ErrorKind::invalid_input);
  CHECK(segment_forging(cv::Mat::zeros(kSize, CV_8UC3), prior(), {}).error().kind == ErrorKind::invalid_input);
  CHECK_FALSE(segment_forging(cv::Mat::zeros(3, 900, CV_8U), prior(), {}));
  SegmentPrior p = prior();
  p.diameter_max_px = 10;
  CHECK(segment_forging(cv::Mat::zeros(kSize, CV_8U), p, {}).error().kind == ErrorKind::invalid_input);
  CHECK(SegmentConfig{}.validate());
  SegmentConfig config;
  config.max_tilt_deg = 90;
  CHECK_FALSE(config.validate());
}

}  // namespace imprint
