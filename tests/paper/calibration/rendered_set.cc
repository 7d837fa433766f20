#include "tests/paper/calibration/rendered_set.h"

#include <atomic>
#include <optional>
#include <thread>

#include "node/detect/detect_config.h"
#include "simulation/simulation.h"

namespace imprint::paper {
namespace {

constexpr int kRolls = 7, kTargetsAFrame = 30, kTargetsAPair = 28;

// A hall without its forging: a small dark bar stands in its place, as the renderer wants a body.
Scene empty_hall(const PublishedScale& scale, unsigned seed) {
  Scene scene;
  scene.name = "calibration";
  scene.kind = SceneKind::forge;
  scene.seed = seed;
  scene.corruption = 1.0;
  const double size = scale.distance_mm / 9000.0;
  scene.forging.length_mm = 100.0 * size;
  scene.forging.stations = {{0.0, 40.0 * size}};
  scene.forging.transition_mm = 5.0 * size;
  scene.forging.eccentricity_mm = scene.forging.bow_mm = scene.forging.circularity_mm = 0.0;
  scene.forging.press_marks = 0;
  scene.forging.center_world_mm = {0.0, 0.0, 1000.0};
  scene.surface.level = 0.0;
  scene.surface.scale_coverage = scene.surface.halo = 0.0;
  scene.surface.sparks = 0;
  scene.imaging.haze_rms_px = 0.0;
  scene.targets.dot_diameter_mm = scale.dot_diameter_mm;
  scene.targets.plate_mm = scale.plate_mm;
  scene.targets.dirty_fraction = scene.targets.hidden_fraction = 0.0;
  scene.observations.rotations_deg = {0.0};
  scene.spec.diameter_min_mm = 150.0 * size;
  scene.spec.diameter_max_mm = 340.0 * size;
  scene.spec.end_section_mm = 30.0 * size;
  return scene;
}

// The forging of the forge scene, to the scale.
void put_forging(Scene& scene, const PublishedScale& scale) {
  const double size = scale.distance_mm / 9000.0;
  ForgingScene& f = scene.forging;
  f.length_mm = 1900.0 * size;
  f.stations = {{0.0, 180.0 * size}, {420.0 * size, 300.0 * size}, {1420.0 * size, 225.0 * size}};
  f.transition_mm = 34.0 * size;
  scene.spec.end_section_mm = 80.0 * size;
}

Result<RenderedSet> render(Scene scene, int jobs) {
  const auto layout = lay_out(scene);
  if (!layout) return pass_on(layout.error());
  RenderedSet set;
  for (const Plate& plate : layout->plates) set.field.targets[plate.code.id].p_world_mm = plate.center_world_mm;
  set.poses = layout->poses;
  const std::size_t cameras = scene.cameras.size(), frames = cameras * scene.observations.rotations_deg.size();
  set.detected.resize(frames);
  std::vector<std::optional<Error>> faults(frames);
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < frames; i = next++) {
      const auto image = render_frame(scene, static_cast<int>(i / cameras), scene.cameras[i % cameras].model.id);
      if (image)
        set.detected[i] = detect_targets(*image, layout->library, DetectConfig{});
      else
        faults[i] = image.error();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int k = 0; k < jobs; ++k) threads.emplace_back(work);
  }
  for (const auto& fault : faults)
    if (fault) return pass_on(*fault);
  set.scene = std::move(scene);
  return set;
}

}  // namespace

Result<RenderedSet> render_calibration(const PublishedScale& scale, std::size_t camera, unsigned seed, int jobs) {
  Scene scene = empty_hall(scale, seed);
  scene.targets.per_camera = kTargetsAFrame;
  for (int k = 0; k < kRolls; ++k) {
    SceneCamera view;
    view.model = camera_of(scale.cameras[camera]);
    view.model.id = "roll" + std::to_string(k);
    view.distance_mm = scale.distance_mm;
    view.elevation_deg = 35.0;
    view.offset_x_mm = 0.02 * scale.distance_mm * (k % 3 - 1);
    view.roll_deg = 360.0 * k / kRolls;
    view.aim_world_mm = {0.0, 0.0, 0.15 * scale.distance_mm};
    scene.cameras.push_back(view);
  }
  scene.forging.center_world_mm = scene.cameras[0].aim_world_mm;
  return render(std::move(scene), jobs);
}

Result<RenderedSet> render_pair(const PublishedScale& scale, bool hot, int observations, unsigned seed, int jobs) {
  Scene scene = empty_hall(scale, seed);
  scene.targets.per_camera = kTargetsAPair;
  scene.observations.rotations_deg.assign(static_cast<std::size_t>(observations), 0.0);
  put_forging(scene, scale);
  if (hot) {
    const Scene forge;
    scene.surface = forge.surface;
    scene.imaging.haze_rms_px = forge.imaging.haze_rms_px;
  }
  for (std::size_t c = 0; c < 2; ++c) {
    SceneCamera view;
    view.model = camera_of(scale.cameras[c]);
    view.distance_mm = scale.distance_mm;
    view.elevation_deg = 40.0;
    view.offset_x_mm = (c == 0 ? -0.5 : 0.5) * scale.base_mm;
    view.aim_world_mm = {0.0, 0.0, 0.15 * scale.distance_mm};
    scene.cameras.push_back(view);
  }
  scene.forging.center_world_mm = scene.cameras[0].aim_world_mm;
  return render(std::move(scene), jobs);
}

}  // namespace imprint::paper
