#include "simulation/props.h"

#include <cmath>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "simulation/silhouette_outline.h"
#include "simulation/simulation.h"
#include "simulation/truth.h"

namespace imprint {
namespace {

// One camera, nothing that is not geometry: even grey levels.
Scene bare_scene() {
  auto scene = read_scene(IMPRINT_TEST_DATA "/small_forge.toml");
  REQUIRE(scene);
  scene->corruption = 0.0;
  scene->imaging.noise = scene->imaging.vignetting = scene->imaging.haze_rms_px = 0.0;
  scene->surface.limb_darkening = scene->surface.halo = scene->surface.temperature_drop_c = 0.0;
  scene->backdrop.clutter = 0.0;
  scene->observations.rotations_deg = {0.0};
  return *scene;
}

double covered_mm(const std::vector<std::pair<double, double>>& ranges) {
  double sum = 0.0;
  for (const auto& [from, to] : ranges) sum += to - from;
  return sum;
}

int level_at(const cv::Mat& frame, const ObservedPoint& p) {
  return frame.at<unsigned char>(static_cast<int>(std::lround(p.y_px)), static_cast<int>(std::lround(p.x_px)));
}

}  // namespace

TEST_CASE("props: a jaw hides the end it holds, and the truth says how far") {
  Scene scene = bare_scene();
  scene.jaw = {JawScene::End::first, 300.0, 0.2};
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const int camera = static_cast<int>(c);
    const auto outline =
        body_outline(layout->body, layout->body_poses[0], scene.cameras[c].model, layout->poses[c], 0.25);
    REQUIRE(outline);
    const auto props = props_of(scene, *layout, 0, camera);
    for (const auto* rim : {&outline->upper, &outline->lower}) {
      const auto ranges = hidden_ranges_mm(props, *rim, layout->body.length_mm());
      if (ranges.empty()) continue;  // from above, the jaw below the forging hides nothing
      CHECK(ranges.front().first == 0.0);
      // Seen aslant, the jaw's near corner stands up to its own depth before the rim it covers.
      CHECK(ranges.back().second == Approx(300.0).margin(60.0));
    }
    CHECK(covered_mm(hidden_ranges_mm(props, outline->upper, layout->body.length_mm())) +
              covered_mm(hidden_ranges_mm(props, outline->lower, layout->body.length_mm())) >
          250.0);
  }
  // The nearly level camera sees the jaw before the axis there, and steel where the jaw has ended.
  const auto frame = render_frame(scene, 0, "cam3");
  REQUIRE(frame);
  const auto shown = [&](double x_mm) {
    return level_at(*frame, project(scene.cameras[2].model, layout->poses[2].cam_from_world(
                                                                layout->body_poses[0].world_from_body({x_mm, 0, 0}))));
  };
  CHECK(shown(100.0) < 80);
  CHECK(shown(500.0) > 150);
}

TEST_CASE("props: V-blocks hide the lower rim where they stand and nowhere else") {
  Scene scene = bare_scene();
  scene.v_blocks = {{500.0, 1500.0}, 100.0, 0.3};
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  const auto outline =
      body_outline(layout->body, layout->body_poses[0], scene.cameras[2].model, layout->poses[2], 0.25);
  REQUIRE(outline);
  const auto props = props_of(scene, *layout, 0, 2);
  CHECK(hidden_ranges_mm(props, outline->upper, layout->body.length_mm()).empty());
  const auto lower = hidden_ranges_mm(props, outline->lower, layout->body.length_mm());
  REQUIRE(lower.size() == 2);
  CHECK(lower[0].first == Approx(450.0).margin(20.0));  // seen from 3 deg above and 320 mm aside
  CHECK(lower[1].second == Approx(1550.0).margin(20.0));
}

TEST_CASE("props: another body appears where it lies, before the forging only when it is nearer") {
  Scene scene = bare_scene();
  OtherBody other;
  other.center_world_mm = scene.forging.center_world_mm + Eigen::Vector3d(0, -1500, 0);
  other.length_mm = 400.0, other.diameter_mm = 900.0, other.level = 0.3;
  scene.others = {other};
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  const auto seen_at = [&](const Eigen::Vector3d& p) {
    return project(scene.cameras[2].model, layout->poses[2].cam_from_world(p));
  };
  const auto far = render_frame(scene, 0, "cam3");
  REQUIRE(far);
  CHECK(level_at(*far, seen_at(other.center_world_mm + Eigen::Vector3d(0, 0, 350))) == Approx(77).margin(14));
  CHECK(level_at(*far, seen_at(scene.forging.center_world_mm)) > 150);
  scene.others[0].center_world_mm.y() += 3000;
  const auto near = render_frame(scene, 0, "cam3");
  REQUIRE(near);
  CHECK(level_at(*near, seen_at(scene.others[0].center_world_mm)) == Approx(77).margin(14));  // its grain: 12 %
  const auto outline =
      body_outline(layout->body, layout->body_poses[0], scene.cameras[2].model, layout->poses[2], 0.25);
  REQUIRE(outline);
  CHECK(covered_mm(hidden_ranges_mm(props_of(scene, *layout, 0, 2), outline->upper, layout->body.length_mm())) > 300.0);
}

TEST_CASE("props: an empty hall shows no forging, and its truth claims none") {
  Scene scene = bare_scene();
  scene.forging.present = false;
  const auto layout = lay_out(scene);
  REQUIRE(layout);
  const auto frame = render_frame(scene, 0, "cam1");
  REQUIRE(frame);
  CHECK(level_at(*frame,
                 project(scene.cameras[0].model, layout->poses[0].cam_from_world(scene.forging.center_world_mm))) < 20);
  const auto truth = nlohmann::json::parse(truth_json(scene, *layout).value());
  CHECK(truth.at("present") == false);
  const auto& camera = truth.at("observations").at(0).at("cameras").at(0);
  CHECK(camera.contains("targets"));
  CHECK_FALSE(camera.contains("upper"));
}

TEST_CASE("props: clutter stronger than the forging leaves the rest of the hall as it was") {
  Scene scene = bare_scene();
  scene.backdrop.clutter = 1.0;
  const auto before = render_frame(scene, 0, "cam1");
  scene.backdrop.strong_clutter = 1.0, scene.backdrop.strong_level = 1.0;
  const auto after = render_frame(scene, 0, "cam1");
  REQUIRE((before && after));
  const cv::Mat changed = *before != *after;
  const double share = static_cast<double>(cv::countNonZero(changed)) / static_cast<double>(changed.total());
  CHECK(share > 0.01);
  CHECK(share < 0.3);
  CHECK(cv::mean(*after, changed)[0] > 1.5 * cv::mean(*before, changed)[0]);
}

}  // namespace imprint
