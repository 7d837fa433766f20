#include "node/edge/locate_edges.h"

#include <cmath>
#include <numbers>
#include <random>

#include <catch2/catch.hpp>

#include "node/edge/edge_config.h"
#include "node/edge/subpixel.h"
#include "tests/unit/node/segment/drawn_forging.h"

namespace imprint {
namespace {

const cv::Size kSize(700, 260);

drawn::Body strip(double blur) {
  drawn::Body body;
  body.origin = {350, 130};
  body.start_px = -2000, body.end_px = 2000;  // out of view: no end disturbs
  body.level = 150, body.background = 50, body.blur_px = blur;
  return body;
}

// The segmentation a perfect first stage would give, `error_px` off.
Segmentation expected(const drawn::Body& body, int from, int to, double error_px = 0) {
  Segmentation s;
  s.origin = {std::round(body.origin.x_px), std::round(body.origin.y_px)};
  s.direction_x = std::cos(body.tilt_rad), s.direction_y = std::sin(body.tilt_rad);
  s.first_station_px = from;
  for (int station = from; station <= to; ++station) {
    const cv::Vec2d p =
        body.along_and_across(s.origin.x_px + station * s.direction_x, s.origin.y_px + station * s.direction_y);
    const double middle = body.middle_px(p[0]) - p[1], half = body.half_width_px(p[0]);
    s.upper_offset_px.push_back(static_cast<float>(middle - half + error_px));
    s.lower_offset_px.push_back(static_cast<float>(middle + half + error_px));
  }
  return s;
}

struct Deviation {
  double bias = 0, rms = 0, worst = 0;
  std::size_t count = 0;
};

// Of both rims' edge points from the drawn outline, px normal to the axis.
Deviation deviation(const Silhouette& found, const drawn::Body& body) {
  Deviation d;
  const Segmentation& s = found.frame;
  double sum[2] = {}, squares = 0;
  for (const bool upper : {true, false}) {
    for (const EdgePoint& e : upper ? found.upper : found.lower) {
      const cv::Vec2d p =
          body.along_and_across(s.origin.x_px + e.station_px * s.direction_x - e.offset_px * s.direction_y,
                                s.origin.y_px + e.station_px * s.direction_y + e.offset_px * s.direction_x);
      const double half = body.half_width_px(p[0]);
      const double error = p[1] - body.middle_px(p[0]) - (upper ? -half : half);
      sum[upper] += error, squares += error * error;
      d.worst = std::max(d.worst, std::abs(error));
      ++d.count;
    }
  }
  d.bias = std::max(std::abs(sum[0]) / static_cast<double>(std::max<std::size_t>(1, found.lower.size())),
                    std::abs(sum[1]) / static_cast<double>(std::max<std::size_t>(1, found.upper.size())));
  d.rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, d.count)));
  return d;
}

// Smallest standard deviation that any estimator can have on one line of pixels, levels and blur known.
double bound(double noise, double step, double blur) {
  return 1.88 * noise / step * std::sqrt(std::hypot(blur, std::sqrt(1.0 / 12)));
}

}  // namespace

TEST_CASE("edge: no bias at any subpixel phase") {
  // A fortieth of a grey level of rounding noise averages out over 1400 points; 0.005 px is what issue-level accuracy
  // asks.
  for (const double blur : {0.5, 0.8, 1.5, 2.0}) {
    for (const double phase : {0.0, 0.1, 0.25, 0.4, 0.5, 0.75, 0.9}) {
      drawn::Body body = strip(blur);
      body.origin.y_px += phase;
      body.half_width_px = [phase](double) { return 50.0 + 0.3 * phase; };
      const cv::Mat image = drawn::expose(drawn::draw(body, kSize), 0, 1, CV_16U);
      const auto best = locate_edges(image, expected(body, -340, 340, 0.6), Polarity::bright, EdgeMethod::best, {});
      INFO("blur " << blur << " phase " << phase);
      REQUIRE(best.upper.size() > 660);
      REQUIRE(best.lower.size() > 660);
      CHECK(deviation(best, body).bias < 0.005);
    }
  }
}

TEST_CASE("edge: no bias at any slope, along rows and along columns") {
  for (const double blur : {0.5, 1.0, 2.0}) {
    for (const double tilt_deg : {0.7, 3.0, 10.0, 90.0, 95.0, -80.0, 180.0}) {
      drawn::Body body = strip(blur);
      body.tilt_rad = tilt_deg * std::numbers::pi / 180;
      const bool upright = std::abs(std::sin(body.tilt_rad)) > 0.7;
      body.origin = upright ? ObservedPoint{130.2, 350} : ObservedPoint{350, 130.2};
      const cv::Size size = upright ? cv::Size(260, 700) : kSize;
      const cv::Mat image = drawn::expose(drawn::draw(body, size), 0, 1, CV_16U);
      const auto best = locate_edges(image, expected(body, -300, 300), Polarity::bright, EdgeMethod::best, {});
      const Deviation d = deviation(best, body);
      INFO("blur " << blur << " tilt " << tilt_deg << " bias " << d.bias << " rms " << d.rms << " count " << d.count);
      REQUIRE(best.upper.size() > 580);
      CHECK(d.bias < 0.005);
      CHECK(d.worst < 0.04);  // at blur 0.5 the pixels undersample the edge
    }
  }
}

TEST_CASE("edge: best comes near the bound, the paper's zero crossing stays within its factor") {
  for (const double blur : {0.5, 0.8, 1.2, 2.0}) {
    drawn::Body body = strip(blur);
    body.tilt_rad = 0.012;  // all phases of the pixel grid occur
    const cv::Mat image = drawn::expose(drawn::draw(body, kSize), 3, 7);
    Segmentation s = expected(body, -340, 340);
    s.direction_x = 1, s.direction_y = 0;  // along the rows: no interpolation between stations averages the noise
    for (std::size_t i = 0; i < s.upper_offset_px.size(); ++i) {
      const auto rise = static_cast<float>(std::tan(body.tilt_rad) * (s.first_station_px + static_cast<double>(i)));
      s.upper_offset_px[i] = rise - 50, s.lower_offset_px[i] = rise + 50;
    }
    const double least = bound(3, 100, blur);
    const Deviation best = deviation(locate_edges(image, s, Polarity::bright, EdgeMethod::best, {}), body);
    const Deviation paper = deviation(locate_edges(image, s, Polarity::bright, EdgeMethod::uniform, {}), body);
    const Deviation pixel = deviation(locate_edges(image, s, Polarity::bright, EdgeMethod::pixel, {}), body);
    INFO("blur " << blur << ": best " << best.rms / least << ", zero crossing " << paper.rms / least << ", pixel "
                 << pixel.rms << " px");
    CHECK(best.rms < 1.35 * least);  // the window's levels and their slopes are unknown and estimated too
    CHECK(best.rms < 1.02 * paper.rms);
    CHECK(paper.rms < (blur < 1.5 ? 2.0 : 3.5) * least);
    CHECK(pixel.rms > paper.rms);
  }
}

TEST_CASE("edge: sigma says how far the points scatter") {
  drawn::Body body = strip(1.0);
  body.origin.y_px += 0.4;
  for (const double noise : {1.0, 4.0, 8.0}) {
    const auto found = locate_edges(drawn::expose(drawn::draw(body, kSize), noise, 3), expected(body, -340, 340),
                                    Polarity::bright, EdgeMethod::best, {});
    double sum = 0;
    for (const EdgePoint& p : found.upper) sum += p.sigma_px * p.sigma_px;
    const double claimed = std::sqrt(sum / static_cast<double>(found.upper.size()));
    const double seen = deviation(found, body).rms;
    INFO("noise " << noise << " claimed " << claimed << " seen " << seen);
    CHECK(claimed > 0.8 * seen);
    CHECK(claimed < 1.4 * seen);
  }
}

TEST_CASE("edge: contrast of 25 grey levels, dark on bright, 16 bit") {
  drawn::Body body = strip(1.0);
  SECTION("25 levels") {
    body.level = 75;
    const auto found = locate_edges(drawn::expose(drawn::draw(body, kSize), 3, 4), expected(body, -340, 340),
                                    Polarity::bright, EdgeMethod::best, {});
    CHECK(found.upper.size() > 640);
    CHECK(deviation(found, body).rms < 1.35 * bound(3, 25, 1.0));  // the fit is no longer linear in the noise
    CHECK(found.contrast == Approx(25.0 / 255).epsilon(0.05));
  }
  SECTION("dark") {
    body.level = 40, body.background = 220;
    const auto found = locate_edges(drawn::expose(drawn::draw(body, kSize), 3, 5), expected(body, -340, 340),
                                    Polarity::dark, EdgeMethod::best, {});
    CHECK(deviation(found, body).rms < 1.4 * bound(3, 180, 1.0));  // where noise is low, less of the levels is read
    CHECK(found.contrast == Approx(180.0 / 255).epsilon(0.05));
    CHECK(found.upper[100].direction_deg == Approx(90).margin(5));
    CHECK(found.lower[100].direction_deg == Approx(90).margin(5));
  }
}

TEST_CASE("edge: the outermost edge is taken where scale shows a weaker rim") {
  drawn::Body body = strip(0.9);
  body.patches = {{-100, -40, true, 9, 75}, {60, 110, false, 12, 70}};  // scale 20 to 25 levels over the background
  const cv::Mat image = drawn::expose(drawn::draw(body, kSize), 3, 6);
  const auto best = locate_edges(image, expected(body, -340, 340), Polarity::bright, EdgeMethod::best, {});
  int displaced = 0;
  for (const EdgePoint& p : best.upper) displaced += std::abs(p.offset_px + 50) > 1;
  for (const EdgePoint& p : best.lower) displaced += std::abs(p.offset_px - 50) > 1;
  CHECK(displaced <= 8);  // at the patches' corners
  CHECK(best.upper.size() > 640);
}

// A round body of radius 50 px whose radiance falls towards its limb, blurred, its axis 0.6 deg off the rows.
cv::Mat limb_darkened(const drawn::Body& body, double darkening, unsigned seed) {
  constexpr double kRadius = 50.0, kFinePx = 0.02;
  const int reach = static_cast<int>((kRadius + 20) / kFinePx);
  std::vector<double> sharp(static_cast<std::size_t>(2 * reach + 1)), blurred(sharp.size());
  for (int i = -reach; i <= reach; ++i) {
    const double share = std::abs(i * kFinePx) / kRadius;
    const double facing = share < 1 ? std::sqrt(1 - share * share) : 0.0;
    sharp[static_cast<std::size_t>(i + reach)] =
        share < 1 ? body.level * (1 - darkening * (1 - facing)) : body.background;
  }
  const int far = static_cast<int>(5 * body.blur_px / kFinePx);
  for (int i = -reach; i <= reach; ++i) {
    double sum = 0, weight = 0;
    for (int k = std::max(-reach, i - far); k <= std::min(reach, i + far); k += 2) {
      const double z = (k - i) * kFinePx / body.blur_px, w = std::exp(-0.5 * z * z);
      sum += w * sharp[static_cast<std::size_t>(k + reach)], weight += w;
    }
    blurred[static_cast<std::size_t>(i + reach)] = sum / weight;
  }
  cv::Mat_<float> image(kSize, static_cast<float>(body.background));
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double across = body.along_and_across(x, y)[1] - body.middle_px(0);
      const auto at = static_cast<long>(std::lround(across / kFinePx)) + reach;
      if (at >= 0 && at < static_cast<long>(blurred.size()))
        image(y, x) = static_cast<float>(blurred[static_cast<std::size_t>(at)]);
    }
  }
  return drawn::expose(image, 2, seed);
}

TEST_CASE("edge: limb darkening does not move the rim") {
  for (const double darkening : {0.0, 0.25, 0.5}) {
    drawn::Body body = strip(0.9);
    body.background = 20;
    body.tilt_rad = 0.01;
    const cv::Mat image = limb_darkened(body, darkening, 21);
    const auto found = locate_edges(image, expected(body, -340, 340), Polarity::bright, EdgeMethod::best, {});
    double outward = 0, count = 0;
    for (const EdgePoint& e : found.upper) outward += -50 - e.offset_px, ++count;
    for (const EdgePoint& e : found.lower) outward += e.offset_px - 50, ++count;
    INFO("darkening " << darkening << ": " << outward / count << " px outwards over " << count << " points");
    REQUIRE(count > 1200);
    // A plain step goes 0.1 px and more inwards at 0.5; what is left is the terms after the square root.
    CHECK(std::abs(outward / count) < 0.035);
  }
}

TEST_CASE("edge: scale colder than the background shows as a dip outside its edge, and only there") {
  drawn::Body body = strip(0.9);
  body.patches = {{-100, -20, true, 3.5, 25}};  // below the background's 50: the edge is found at its inner border
  const cv::Mat image = drawn::expose(drawn::draw(body, kSize), 3, 6);
  const auto found = locate_edges(image, expected(body, -340, 340), Polarity::bright, EdgeMethod::best, {});
  int hidden = 0, told = 0, plain = 0, alarmed = 0;
  for (const EdgePoint& p : found.upper) {
    if (p.station_px > -90 && p.station_px < -30) {
      ++hidden, told += p.outside_dip > 0.1;
    } else if (p.station_px < -125 || p.station_px > 5) {
      ++plain, alarmed += p.outside_dip > 0.025 || p.outside_bump > 0.07;
    }
  }
  REQUIRE(hidden > 40);
  CHECK(told > 0.9 * hidden);
  CHECK(alarmed < 0.02 * plain);
}

TEST_CASE("edge: a beam beside the rim is not taken for its outermost edge") {
  drawn::Body body = strip(0.9);
  cv::Mat_<float> image = drawn::draw(body, kSize);
  drawn::draw_bar(image, {0, 64, 700, 8}, 170);  // 8 to 16 px above the upper rim, with background between
  const auto best =
      locate_edges(drawn::expose(image, 3, 8), expected(body, -340, 340), Polarity::bright, EdgeMethod::best, {});
  CHECK(deviation(best, body).worst < 1);
}

TEST_CASE("edge: both ends to 0.3 px and better, with and without an arc, tilted or upright") {
  for (const double bulge : {0.0, 6.0, 20.0}) {
    for (const double tilt_deg : {0.0, 4.0, 10.0, 92.0}) {
      drawn::Body body = strip(1.0);
      body.tilt_rad = tilt_deg * std::numbers::pi / 180;
      const bool upright = tilt_deg > 45;
      body.origin = upright ? ObservedPoint{130, 350} : ObservedPoint{350, 130};
      body.start_px = -240.3, body.end_px = 230.6, body.end_bulge_px = bulge;
      const cv::Size size = upright ? cv::Size(260, 700) : cv::Size(700, 300);
      const cv::Mat image = drawn::expose(drawn::draw(body, size), 3, 9);
      Segmentation s = expected(body, -236, 226);
      const auto found = locate_edges(image, s, Polarity::bright, EdgeMethod::best, {});
      INFO("bulge " << bulge << " tilt " << tilt_deg << " start " << found.start.station_px << " end "
                    << found.end.station_px);
      REQUIRE(found.start.visible);
      REQUIRE(found.end.visible);
      // The apex of the arc, on the axis; a parabola through the middle of an ellipse is off by 0.1 px for the largest.
      CHECK(std::abs(found.start.station_px - (body.start_px - bulge)) < (bulge > 10 ? 0.15 : 0.08));
      CHECK(std::abs(found.end.station_px - (body.end_px + bulge)) < (bulge > 10 ? 0.15 : 0.08));
      CHECK(found.start.sigma_px > 0);
      CHECK(found.start.sigma_px < 0.1);
    }
  }
}

TEST_CASE("edge: an end found by the segmentation 60 px short is still located") {
  drawn::Body body = strip(1.0);
  body.start_px = -240.3, body.end_px = 230.6;
  const auto found = locate_edges(drawn::expose(drawn::draw(body, kSize), 3, 9), expected(body, -180, 226),
                                  Polarity::bright, EdgeMethod::best, {});
  REQUIRE(found.start.visible);
  CHECK(std::abs(found.start.station_px - body.start_px) < 0.08);
  CHECK(found.upper.front().station_px < -230);
}

TEST_CASE("edge: a body that leaves the image has no visible end there") {
  drawn::Body body = strip(1.0);
  body.start_px = -240;
  const auto found = locate_edges(drawn::expose(drawn::draw(body, kSize), 3, 10), expected(body, -238, 345),
                                  Polarity::bright, EdgeMethod::best, {});
  CHECK(found.start.visible);
  CHECK_FALSE(found.end.visible);
  CHECK(found.lower.back().station_px > 335);
}

TEST_CASE("edge: saturation is told") {
  drawn::Body body = strip(1.0);
  body.level = 400;
  const auto found = locate_edges(drawn::expose(drawn::draw(body, kSize), 2, 11), expected(body, -340, 340),
                                  Polarity::bright, EdgeMethod::best, {});
  CHECK(found.saturated_fraction > 0.95);
  CHECK(found.upper.size() > 640);
}

TEST_CASE("edge: an empty segmentation gives no points, a wrong one no crash") {
  const cv::Mat image = drawn::expose(cv::Mat_<float>(kSize, 20.0F), 3, 12);
  CHECK(locate_edges(image, Segmentation{}, Polarity::bright, EdgeMethod::best, {}).upper.empty());
  const drawn::Body body = strip(1.0);
  for (const EdgeMethod method : {EdgeMethod::best, EdgeMethod::uniform, EdgeMethod::pixel}) {
    CHECK_NOTHROW(locate_edges(image, expected(body, -340, 340), Polarity::bright, method, {}));
    CHECK_NOTHROW(locate_edges(image, expected(body, -2000, 2000), Polarity::bright, method, {}));
    CHECK_NOTHROW(
        locate_edges(cv::Mat(3, 3, CV_8U, cv::Scalar(9)), expected(body, -5, 5), Polarity::bright, method, {}));
  }
}

TEST_CASE("edge: method names round trip, others are refused") {
  for (const char* name : {"best", "orientation", "magnitude", "combined", "uniform", "none", "pixel"}) {
    const auto method = edge_method_from_name(name);
    REQUIRE(method);
    CHECK(edge_method_name(*method) == name);
  }
  CHECK(edge_method_from_name("canny").error().kind == ErrorKind::invalid_input);
  CHECK(EdgeConfig{}.validate());
  EdgeConfig config;
  config.scan_spacing_px = 0;
  CHECK_FALSE(config.validate());
}

}  // namespace imprint
