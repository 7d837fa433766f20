#include "node/edge/frame_measures.h"

#include <cmath>
#include <random>

#include <catch2/catch.hpp>

#include "node/edge/edge_config.h"
#include "node/edge/rim_haze.h"
#include "tests/unit/node/edge/straight_edge.h"
#include "tests/unit/node/segment/drawn_forging.h"

namespace imprint {
namespace {

using drawn::StraightBand;

FrameMeasures measured(const cv::Mat& image, const StraightBand& band, EdgeMethod method = EdgeMethod::best) {
  const auto silhouette = locate_edges(image, band.segmentation(), Polarity::bright, method, {});
  return measure_frame(image, silhouette, Polarity::bright);
}

// One rim with noise, hot air that is alike over about 8 stations, a bow and shoulders; every station from 0.
std::vector<EdgePoint> rim(double offset, double noise, double haze, double shoulder_px, unsigned seed) {
  constexpr int kStations = 3000, kReach = 32;
  constexpr double kAlike = 8.0;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> white(kStations + 2 * kReach);
  for (double& w : white) w = normal(random);
  std::vector<EdgePoint> points;
  for (int station = 0; station < kStations; ++station) {
    double smooth = 0, squares = 0;
    for (int k = -kReach; k <= kReach; ++k) {
      const double weight = std::exp(-0.5 * k * k / (kAlike * kAlike));
      smooth += weight * white[static_cast<std::size_t>(station + k + kReach)], squares += weight * weight;
    }
    EdgePoint point;
    point.station_px = station;
    point.offset_px = offset + 1e-6 * (station - 1500.0) * (station - 1500.0) + haze * smooth / std::sqrt(squares) +
                      noise * normal(random) + shoulder_px * (station / 500);
    points.push_back(point);
  }
  return points;
}

}  // namespace

TEST_CASE("frame measures: the blur of the rims is that of the picture, whatever its slope and the edge method") {
  for (const double blur : {0.6, 1.0, 1.8}) {
    for (const double slope : {0.0, 0.02, -0.4}) {
      for (const bool columns : {true, false}) {
        StraightBand band;
        band.blur_px = blur, band.slope = slope, band.columns = columns, band.phase_px = 0.2;
        const cv::Mat image = drawn::expose(drawn::draw(band), 3, 4);
        INFO("blur " << blur << " slope " << slope << " columns " << columns);
        CHECK(measured(image, band).blur_px == Approx(blur).margin(0.05));  // median of some hundred free fits
        CHECK(measured(image, band, EdgeMethod::uniform).blur_px == Approx(blur).margin(0.05));
      }
    }
  }
}

TEST_CASE("frame measures: haze is what moves the rims beyond their noise, not shoulders, bow or the noise itself") {
  for (const double noise : {0.05, 0.15}) {
    for (const double haze : {0.0, 0.1, 0.3}) {
      Silhouette silhouette;
      silhouette.frame.upper_offset_px.assign(3000, -50.0F), silhouette.frame.lower_offset_px.assign(3000, 50.0F);
      silhouette.upper = rim(-50, noise, haze, -8, 1), silhouette.lower = rim(50, noise, haze, 8, 2);
      const double found = rim_haze_px(silhouette);
      INFO("noise " << noise << " haze " << haze << " found " << found);
      if (haze == 0.0) CHECK(found < 0.4 * noise);  // 6000 points, the shoulders' cut by the robust variance
      if (haze > 0.0) CHECK(found == Approx(haze).epsilon(0.25));  // alike at a fifth of the diameter to 0.2
    }
  }
}

TEST_CASE("frame measures: clean straight rims have next to no haze, in rows, columns and between them") {
  for (const double slope : {0.0, 0.02}) {
    StraightBand band;
    band.slope = slope;
    const cv::Mat image = drawn::expose(drawn::draw(band), 3, 6);
    CHECK(measured(image, band).haze_px < 0.03);  // noise of a point: 0.066 px
  }
  drawn::Body body;
  body.origin = {350, 130}, body.tilt_rad = 0.05, body.start_px = -2000, body.end_px = 2000, body.blur_px = 1.0;
  Segmentation s;
  s.origin = body.origin, s.direction_x = std::cos(body.tilt_rad), s.direction_y = std::sin(body.tilt_rad);
  s.first_station_px = -300;
  s.upper_offset_px.assign(600, -50.0F), s.lower_offset_px.assign(600, 50.0F);
  const cv::Mat image = drawn::expose(drawn::draw(body, {700, 260}), 3, 7);
  const auto found = locate_edges(image, s, Polarity::bright, EdgeMethod::best, {});
  CHECK(measure_frame(image, found, Polarity::bright).haze_px < 0.03);
}

TEST_CASE(
    "frame measures: the body's level and what saturates in the frame; a dark body is judged by its surroundings") {
  StraightBand band;
  band.background = 40, band.contrast = 140;
  cv::Mat image = drawn::expose(drawn::draw(band), 0, 1);
  CHECK(measured(image, band).body_level == Approx(180.0 / 255).margin(0.005));
  CHECK(measured(image, band).frame_saturated_fraction == 0.0);
  image(cv::Rect(0, 0, image.cols, 10)).setTo(255);  // a lamp
  CHECK(measured(image, band).frame_saturated_fraction == Approx(10.0 / image.rows));
  CHECK(measured(image, band).body_level == Approx(180.0 / 255).margin(0.005));
  band.background = 200, band.contrast = -150;
  image = drawn::expose(drawn::draw(band), 0, 1);
  const auto dark = locate_edges(image, band.segmentation(), Polarity::dark, EdgeMethod::best, {});
  CHECK(measure_frame(image, dark, Polarity::dark).body_level == Approx(200.0 / 255).margin(0.005));
}

TEST_CASE("frame measures: of nothing there are none") {
  const cv::Mat image(50, 50, CV_8U, cv::Scalar(7));
  const FrameMeasures none = measure_frame(image, Silhouette{}, Polarity::bright);
  CHECK(none.blur_px == 0.0);
  CHECK(none.haze_px == 0.0);
  CHECK(none.body_level == 0.0);
  CHECK_NOTHROW(measure_frame({}, Silhouette{}, Polarity::bright));
}

}  // namespace imprint
