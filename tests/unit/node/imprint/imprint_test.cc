#include "node/imprint/make_imprint.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <catch2/catch.hpp>

#include "node/edge/edge_config.h"
#include "node/imprint/filter_config.h"
#include "node/imprint/paper_filter.h"
#include "node/segment/segment_config.h"
#include "tests/unit/node/segment/drawn_forging.h"

namespace imprint {
namespace {

const cv::Size kSize(1300, 420);

drawn::Body long_body() {
  drawn::Body body;
  body.origin = {650, 210};
  body.start_px = -560.4, body.end_px = 540.7;
  body.middle_px = [](double s) { return 6.0 * (1 - s * s / 360000.0); };  // a bow of 6 px
  body.half_width_px = [](double) { return 60.0; };
  body.level = 150, body.background = 40;
  return body;
}

SegmentPrior prior() {
  SegmentPrior p;
  p.diameter_min_px = 70, p.diameter_max_px = 220;
  return p;
}

// Segment, edge and filter.
Result<FilteredSilhouette> filtered(const cv::Mat& image, EdgeMethod method = EdgeMethod::best) {
  auto segmentation = segment_forging(image, prior(), {});
  if (!segmentation) return pass_on(segmentation.error());
  return filter_silhouette(locate_edges(image, *segmentation, Polarity::bright, method, {}), method, {});
}

struct Errors {
  double rms = 0, worst = 0, trusted = 0;
};

enum class Curve { upper, lower, axis };

// Of the trusted points against the drawn outline, `margin` stations from the ends left out.
Errors errors(const FilteredSilhouette& s, const drawn::Body& body, Curve which, double margin = 12) {
  const auto& points = which == Curve::upper ? s.upper : which == Curve::lower ? s.lower : s.axis;
  const double sign = which == Curve::upper ? -1 : which == Curve::lower ? 1 : 0;
  Errors e;
  double squares = 0, count = 0, all = 0;
  for (const FilteredPoint& point : points) {
    const cv::Vec2d p = body.along_and_across(
        s.frame.origin.x_px + point.station_px * s.frame.direction_x - point.offset_px * s.frame.direction_y,
        s.frame.origin.y_px + point.station_px * s.frame.direction_y + point.offset_px * s.frame.direction_x);
    if (p[0] < body.start_px + margin || p[0] > body.end_px - margin) continue;
    all += 1;
    if (!(point.weight > 0.2)) continue;
    const double error = p[1] - body.middle_px(p[0]) - sign * body.half_width_px(p[0]);
    squares += error * error, count += 1;
    e.worst = std::max(e.worst, std::abs(error));
  }
  e.rms = std::sqrt(squares / std::max(1.0, count));
  e.trusted = count / std::max(1.0, all);
  return e;
}

CameraModel plain_camera() {
  CameraModel camera;
  camera.id = "cam1";
  camera.width_px = kSize.width, camera.height_px = kSize.height;
  camera.focal_length_px = 1500;
  camera.principal_point = {648.3, 211.7};
  return camera;
}

}  // namespace

TEST_CASE("imprint: a clean body comes out to hundredths of a pixel") {
  const drawn::Body body = long_body();
  const auto found = filtered(drawn::expose(drawn::draw(body, kSize), 3, 1));
  REQUIRE(found);
  for (const Curve which : {Curve::upper, Curve::lower, Curve::axis}) {
    const Errors e = errors(*found, body, which);
    INFO("rms " << e.rms << " worst " << e.worst << " trusted " << e.trusted);
    CHECK(e.rms < 0.03);  // 0.065 px a point, about 10 points in a window's parabola
    CHECK(e.worst < 0.12);
    CHECK(e.trusted > 0.98);
  }
  CHECK(found->start.visible);
  CHECK(found->end.visible);
}

TEST_CASE("imprint: all seven methods run and keep their order") {
  const drawn::Body body = long_body();
  const cv::Mat image = drawn::expose(drawn::draw(body, kSize), 3, 2);
  double rms[7] = {};
  for (const EdgeMethod method : {EdgeMethod::best, EdgeMethod::orientation, EdgeMethod::magnitude,
                                  EdgeMethod::combined, EdgeMethod::uniform, EdgeMethod::none, EdgeMethod::pixel}) {
    const auto found = filtered(image, method);
    INFO(edge_method_name(method));
    REQUIRE(found);
    rms[static_cast<int>(method)] = errors(*found, body, Curve::upper).rms;
    CHECK(errors(*found, body, Curve::upper).rms < 0.4);
    CHECK(errors(*found, body, Curve::axis).rms < 0.3);
    Imprint imprint;
    REQUIRE(fill_curves(*found, plain_camera(), imprint));
    CHECK(imprint.axis.offset_px.size() == kImprintStations);
  }
  const auto at = [&](EdgeMethod method) { return rms[static_cast<int>(method)]; };
  CHECK(at(EdgeMethod::best) < at(EdgeMethod::uniform));
  CHECK(at(EdgeMethod::uniform) < at(EdgeMethod::none));
  CHECK(at(EdgeMethod::uniform) < at(EdgeMethod::pixel));
}

TEST_CASE("imprint: equation 1 gives 1 at the ideal and one half at the population's mean") {
  std::vector<EdgePoint> points(3);
  points[0].magnitude = 0.4, points[1].magnitude = 0.3, points[2].magnitude = 0.2;
  points[0].direction_deg = 90, points[1].direction_deg = 100, points[2].direction_deg = 70;
  const auto magnitude = edge_weights(points, EdgeMethod::magnitude);
  CHECK(magnitude[0] == Approx(1.0));
  CHECK(magnitude[1] == Approx(0.5));
  CHECK(magnitude[2] == Approx(std::pow(0.5, 4)));
  const auto direction = edge_weights(points, EdgeMethod::orientation);
  CHECK(direction[0] == Approx(1.0));
  CHECK(direction[1] == Approx(0.5));  // 10 deg off is the mean
  const auto combined = edge_weights(points, EdgeMethod::combined);
  CHECK(combined[2] == Approx(0.5 * (magnitude[2] + direction[2])));
  CHECK(edge_weights(points, EdgeMethod::uniform) == std::vector<double>(3, 1.0));
}

TEST_CASE("imprint: scale that hides the rim is rejected, not smoothed over") {
  drawn::Body body = long_body();
  // As dark as the background: the true rim cannot be seen there at all.
  body.patches = {
      {-420, -380, true, 6, 40}, {-100, -30, true, 10, 40}, {200, 235, false, 4, 40}, {330, 420, false, 14, 40}};
  const auto found = filtered(drawn::expose(drawn::draw(body, kSize), 3, 3));
  REQUIRE(found);
  for (const Curve which : {Curve::upper, Curve::lower, Curve::axis}) {
    const Errors e = errors(*found, body, which);
    INFO(static_cast<int>(which) << " rms " << e.rms << " worst " << e.worst << " trusted " << e.trusted);
    CHECK(e.rms < 0.15);
    CHECK(e.worst < 1.0);
    CHECK(e.trusted > 0.7);
  }
}

TEST_CASE("imprint: a beam that comes out slowly from behind a rim does not carry it along") {
  const drawn::Body body = long_body();
  const auto stands_out = [](double s) { return s > -150 && s < 150 ? 0.02 * (s + 150) : 0.0; };  // up to 6 px
  drawn::Body before = body, behind = body;
  before.level = 55, before.background = 0, behind.level = 95;
  behind.middle_px = [&](double s) { return body.middle_px(s) + 0.5 * stands_out(s); };
  behind.half_width_px = [&](double s) { return body.half_width_px(s) + 0.5 * stands_out(s); };
  const auto found = filtered(drawn::expose(drawn::draw(before, kSize) + drawn::draw(behind, kSize), 3, 8));
  REQUIRE(found);
  const Errors lower = errors(*found, body, Curve::lower), upper = errors(*found, body, Curve::upper);
  INFO("rms " << lower.rms << " worst " << lower.worst << " trusted " << lower.trusted);
  CHECK(lower.rms < 0.25);  // where it stands out by less than the blur nothing tells it: 0.36 px and 1.5 px otherwise
  CHECK(lower.worst < 1.2);
  CHECK(lower.trusted > 0.7);
  CHECK(lower.trusted < 0.9);
  CHECK(upper.rms < 0.03);
}

TEST_CASE("imprint: steps of the diameter stay sharp") {
  drawn::Body body = long_body();
  body.half_width_px = [](double s) { return s < -150 ? 60.0 : s < 180 ? 84.0 : 72.0; };
  const auto found = filtered(drawn::expose(drawn::draw(body, kSize), 3, 4));
  REQUIRE(found);
  double worst = 0;
  int trusted = 0;
  for (const auto* points : {&found->upper, &found->lower}) {
    for (const FilteredPoint& p : *points) {
      const double station = p.station_px + found->frame.origin.x_px - body.origin.x_px;
      const double beside = std::min(std::abs(station + 150), std::abs(station - 180));
      if (beside < 2.5 || beside > 20) continue;  // the blur itself is 0.9 px wide
      const double offset = p.offset_px + found->frame.origin.y_px - body.origin.y_px - body.middle_px(station);
      trusted += p.weight > 0.2;
      if (p.weight > 0.2) worst = std::max(worst, std::abs(std::abs(offset) - body.half_width_px(station)));
    }
  }
  CHECK(worst < 0.5);
  CHECK(trusted > 100);
  CHECK(errors(*found, body, Curve::axis).worst < 0.3);
}

TEST_CASE("imprint: distortion is removed and 500 stations run from end to end") {
  const drawn::Body body = long_body();
  const auto found = filtered(drawn::expose(drawn::draw(body, kSize), 2, 5));
  REQUIRE(found);
  CameraModel camera = plain_camera();
  camera.distortion.radial = {-0.02, 0.004, 0.0};
  camera.distortion.tangential = {1e-3, -5e-4};
  Imprint imprint;
  REQUIRE(fill_curves(*found, camera, imprint));
  REQUIRE(imprint.start.visible);
  REQUIRE(imprint.end.visible);
  CHECK(imprint.grid.start_px == Approx(imprint.start.station_px));
  CHECK(imprint.grid.station_px(kImprintStations - 1) == Approx(imprint.end.station_px));
  const auto observed = [&](double station, double offset) {
    return distort(camera, imprint.grid.at(station, offset));
  };
  const ObservedPoint start = observed(imprint.start.station_px, imprint.start.offset_px);
  CHECK(std::abs(body.along_and_across(start.x_px, start.y_px)[0] - body.start_px) < 0.1);
  double squares = 0, count = 0;
  for (const ImprintCurve* curve : {&imprint.upper, &imprint.lower, &imprint.axis}) {
    const double sign = curve == &imprint.upper ? -1 : curve == &imprint.lower ? 1 : 0;
    REQUIRE(curve->offset_px.size() == kImprintStations);
    REQUIRE(curve->weight.size() == kImprintStations);
    for (std::size_t i = 6; i + 6 < kImprintStations; ++i) {
      CHECK(std::isfinite(curve->offset_px[i]));
      if (curve->weight[i] < 0.2) continue;
      const ObservedPoint o = observed(imprint.grid.station_px(i), curve->offset_px[i]);
      const cv::Vec2d p = body.along_and_across(o.x_px, o.y_px);
      const double error = p[1] - body.middle_px(p[0]) - sign * body.half_width_px(p[0]);
      squares += error * error, count += 1;
    }
  }
  CHECK(count > 1400);
  CHECK(std::sqrt(squares / count) < 0.03);
}

TEST_CASE("imprint: where nothing was seen the weight is 0 and the offset finite") {
  FilteredSilhouette silhouette;
  silhouette.frame.origin = {650, 210};
  for (int s = -300; s <= 300; ++s) {
    const double weight = s > 40 && s < 120 ? 0.0 : 0.9;
    silhouette.upper.push_back({static_cast<double>(s), -50, weight});
    silhouette.lower.push_back({static_cast<double>(s), 50, weight});
    silhouette.axis.push_back({static_cast<double>(s), 0, weight});
  }
  Imprint imprint;
  REQUIRE(fill_curves(silhouette, plain_camera(), imprint));
  CHECK_FALSE(imprint.start.visible);
  int untrusted = 0;
  for (std::size_t i = 0; i < kImprintStations; ++i) {
    const double station =
        imprint.grid.station_px(i) + imprint.grid.origin.x_px + plain_camera().principal_point.x_px - 650;
    const bool hidden = station > 42 && station < 118;
    if (hidden) CHECK(imprint.upper.weight[i] == 0.0);
    untrusted += hidden;
    CHECK(std::isfinite(imprint.upper.offset_px[i]));
    CHECK(imprint.lower.offset_px[i] - imprint.upper.offset_px[i] == Approx(100).margin(1e-6));
  }
  CHECK(untrusted > 50);
}

TEST_CASE("imprint: too little left is an error that names what was found and needed") {
  Silhouette none;
  const auto few = filter_silhouette(none, EdgeMethod::best, {});
  REQUIRE_FALSE(few);
  CHECK(few.error().kind == ErrorKind::job_failed);
  CHECK(few.error().message.find("at least 50") != std::string::npos);

  Silhouette apart;  // both rims seen, but never at the same station
  for (int s = 0; s < 400; ++s) {
    EdgePoint p;
    p.station_px = s < 200 ? s : s + 400, p.offset_px = s < 200 ? -50 : 50, p.magnitude = 0.2, p.sigma_px = 0.05;
    (s < 200 ? apart.upper : apart.lower).push_back(p);
  }
  for (const EdgeMethod method : {EdgeMethod::best, EdgeMethod::uniform}) {
    const auto result = filter_silhouette(apart, method, {});
    REQUIRE_FALSE(result);
    CHECK(result.error().message.find("4 %") != std::string::npos);
  }
  FilteredSilhouette empty;
  Imprint imprint;
  CHECK_FALSE(fill_curves(empty, plain_camera(), imprint));
}

TEST_CASE("imprint: filter settings out of range are refused") {
  CHECK(FilterConfig{}.validate());
  FilterConfig config;
  config.axis_window = 1;
  CHECK_FALSE(config.validate());
}

}  // namespace imprint
