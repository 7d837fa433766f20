#include <cmath>

#include <catch2/catch.hpp>

#include "simulation/layout.h"
#include "simulation/plate_layout.h"
#include "simulation/plate_painter.h"
#include "simulation/sensor.h"
#include "simulation/silhouette_outline.h"
#include "simulation/simulation.h"
#include "simulation/surface_shader.h"

namespace imprint {
namespace {

// The small forge without anything that is not geometry: even grey body on an even hall.
Scene bare_scene() {
  auto scene = read_scene(IMPRINT_TEST_DATA "/small_forge.toml");
  REQUIRE(scene);
  scene->corruption = 0.0;
  scene->imaging.bits = 16;
  scene->imaging.noise = 0.0;
  scene->imaging.vignetting = 0.0;
  scene->imaging.haze_rms_px = 0.0;
  scene->surface.limb_darkening = scene->surface.halo = scene->surface.temperature_drop_c = 0.0;
  scene->backdrop.clutter = 0.0;
  return *scene;
}

double height_at(const std::vector<ObservedPoint>& rim, double x_px) {
  for (std::size_t i = 1; i < rim.size(); ++i) {
    const ObservedPoint &a = rim[i - 1], &b = rim[i];
    if ((a.x_px - x_px) * (b.x_px - x_px) <= 0.0)
      return a.y_px + (x_px - a.x_px) / (b.x_px - a.x_px) * (b.y_px - a.y_px);
  }
  return NAN;
}

}  // namespace

TEST_CASE("frame: the light of a column puts both rims where the outline has them") {
  const Scene scene = bare_scene();
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const auto frame = render_frame(scene, 0, scene.cameras[c].model.id);
    REQUIRE(frame);
    const auto outline =
        body_outline(layout->body, layout->body_poses[0], scene.cameras[c].model, layout->poses[c], 0.25);
    REQUIRE(outline);
    const double dark = scene.backdrop.level * 65535.0, bright = scene.surface.level * 65535.0;
    for (const double part :
         {0.04, 0.16, 0.3, 0.48, 0.66, 0.8, 0.95}) {  // between the steps, where a column's rim is straight
      const auto at = static_cast<std::size_t>(part * static_cast<double>(outline->upper.size()));
      const int x = static_cast<int>(std::lround(outline->upper[at].x_px));
      const double upper = height_at(outline->upper, x), lower = height_at(outline->lower, x);
      const int middle = static_cast<int>(0.5 * (upper + lower)), reach = static_cast<int>(0.5 * (lower - upper)) + 8;
      double above = 0.0, below = 0.0;
      for (int y = middle - reach; y <= middle; ++y) above += (frame->at<std::uint16_t>(y, x) - dark) / (bright - dark);
      for (int y = middle + 1; y <= middle + reach; ++y)
        below += (frame->at<std::uint16_t>(y, x) - dark) / (bright - dark);
      // 0.002 px: what the truth claims; rounding to 16 bit adds 1e-4 and the rim's bend within the blur less.
      CHECK(middle + 0.5 - above == Approx(upper).margin(0.002));
      CHECK(middle + 0.5 + below == Approx(lower).margin(0.002));
    }
  }
}

TEST_CASE("frame: a clean target's dot has its centroid where the distorted projection puts it") {
  const Scene scene = bare_scene();
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  int checked = 0;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const auto frame = render_frame(scene, 0, scene.cameras[c].model.id);
    REQUIRE(frame);
    for (const Plate& plate : layout->plates) {
      if (!plate_readable(plate, scene.targets.plate_mm, scene.cameras[c].model, layout->poses[c])) continue;
      const DotImage dot = dot_image(plate, scene.targets.dot_diameter_mm, scene.cameras[c].model, layout->poses[c]);
      // A window to the middle of the black gap seen straight on; aslant it would reach the ring.
      if (plate_facing(plate, layout->poses[c]) < 0.93) continue;
      const double reach = 0.5 * dot.diameter_px * 1.5;
      double light = 0.0, mx = 0.0, my = 0.0, black = 65535.0;
      const int cx = static_cast<int>(std::lround(dot.center.x_px)),
                cy = static_cast<int>(std::lround(dot.center.y_px));
      const int window = static_cast<int>(reach) + 1;
      for (int pass = 0; pass < 2; ++pass) {
        for (int y = cy - window; y <= cy + window; ++y) {
          for (int x = cx - window; x <= cx + window; ++x) {
            const double dx = x - dot.ellipse_center.x_px, dy = y - dot.ellipse_center.y_px;
            if (std::hypot(dx, dy) > reach) continue;
            const double value = frame->at<std::uint16_t>(y, x);
            if (pass == 0) {
              black = std::min(black, value);
            } else {
              light += value - black;
              mx += (value - black) * dx;
              my += (value - black) * dy;
            }
          }
        }
      }
      CHECK(std::hypot(mx, my) / light < 0.02);
      ++checked;
    }
  }
  CHECK(checked >= 12);  // about half of the plates face their camera that well
}

TEST_CASE("frame: the same scene gives the same frame, another seed or observation another") {
  auto scene = read_scene(IMPRINT_TEST_DATA "/small_laboratory.toml");
  REQUIRE(scene);
  const auto once = render_frame(*scene, 1, "cam2"), again = render_frame(*scene, 1, "cam2"),
             other = render_frame(*scene, 2, "cam2");
  REQUIRE((once && again && other));
  CHECK(cv::norm(*once, *again, cv::NORM_INF) == 0.0);
  CHECK(cv::norm(*once, *other, cv::NORM_INF) > 0.0);
  scene->seed += 1;
  const auto reseeded = render_frame(*scene, 1, "cam2");
  REQUIRE(reseeded);
  CHECK(cv::norm(*once, *reseeded, cv::NORM_INF) > 50.0);
}

TEST_CASE("frame: asking for a camera or observation that is not there names those that are") {
  const Scene scene = bare_scene();
  const auto no_camera = render_frame(scene, 0, "cam9");
  REQUIRE_FALSE(no_camera);
  CHECK_THAT(no_camera.error().message, Catch::Contains("cam9"));
  const auto no_observation = render_frame(scene, 3, "cam1");
  REQUIRE_FALSE(no_observation);
  CHECK_THAT(no_observation.error().message, Catch::Contains("0 to 2"));
}

TEST_CASE("sensor: the noise has the variance of its electrons") {
  ImagingScene imaging;
  imaging.bits = 16;
  imaging.vignetting = 0.0;
  imaging.full_well_e = 20000.0;
  imaging.read_noise_e = 10.0;
  for (const double level : {0.05, 0.5}) {
    cv::Scalar mean, deviation;
    cv::meanStdDev(expose(imaging, 3, cv::Mat(500, 800, CV_32F, cv::Scalar(level))), mean, deviation);
    const double electrons = level * imaging.full_well_e;
    // 400,000 samples: the mean is known to 0.16 % of the deviation, the deviation to 0.11 %.
    const double expected = std::sqrt(electrons + 100.0) / imaging.full_well_e * 65535.0;
    CHECK(deviation[0] == Approx(expected).epsilon(0.006));
    CHECK(mean[0] == Approx(level * 65535.0).margin(0.01 * expected));
  }
}

TEST_CASE("surface: radiance at 680 nm follows Wien's law") {
  // exp(-c2 / lambda (1/1073.15 - 1/1273.15)) by hand.
  CHECK(relative_radiance(800.0, 1000.0) == Approx(0.0451).epsilon(0.01));
  CHECK(relative_radiance(1000.0, 1000.0) == 1.0);
}

}  // namespace imprint
