#include <cmath>

#include <catch2/catch.hpp>

#include "lib/rig/rig.h"
#include "node/node_pipeline.h"
#include "simulation/haze.h"
#include "simulation/layout.h"
#include "simulation/scene.h"
#include "simulation/silhouette_outline.h"
#include "simulation/simulation.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

struct Seen {
  FrameQuality quality;
  double haze_px = 0.0;  // true RMS of both rims across the axis
};

// What camera 1 of the small forge, scale, sparks and press marks included, shows with another blur and other haze.
Seen seen(double blur_px, double haze_px, std::uint64_t seed) {
  auto scene = read_scene(IMPRINT_TEST_DATA "/small_forge.toml");
  REQUIRE(scene);
  scene->seed = seed;
  scene->observations.rotations_deg = {0.0};
  scene->cameras.resize(1);
  scene->imaging.blur_sigma_px = blur_px, scene->imaging.haze_rms_px = haze_px;
  const TemporaryFolder folder;
  REQUIRE(write_simulation(
      *scene, folder.path(), [](std::string_view, double) {}, 1));
  const auto rig = read_rig(folder / "rig.toml");
  REQUIRE(rig);
  const auto image = render_frame(*scene, 0, "cam1");
  REQUIRE(image);
  const Imprint imprint =
      process_frame({*image, "frame", 1, 0, {}}, rig->cameras.front(), *rig, EdgeMethod::best).imprint;
  REQUIRE(imprint.failure.empty());
  Seen result{imprint.quality, 0.0};
  const auto layout = lay_out(*scene);
  REQUIRE(layout);
  const auto outline =
      body_outline(layout->body, layout->body_poses[0], scene->cameras[0].model, layout->poses[0], 1.0);
  REQUIRE(outline);
  const Haze haze(*scene, *layout, 0, 0);
  double squares = 0.0, count = 0.0;
  for (const auto* rim : {&outline->upper, &outline->lower})
    for (const ObservedPoint& p : *rim) squares += std::pow(haze.at(p).y_px, 2), count += 1.0;
  result.haze_px = std::sqrt(squares / count);
  return result;
}

}  // namespace

TEST_CASE("frame measures: blur and haze of rendered scenes are told through scale, sparks and press marks") {
  for (const std::uint64_t seed : {1U, 2U}) {
    const Seen calm = seen(0.8, 0.0, seed), hazy = seen(0.8, 0.6, seed), soft = seen(1.5, 0.15, seed);
    INFO("seed " << seed << ": blur " << calm.quality.blur_px << ", " << hazy.quality.blur_px << ", "
                 << soft.quality.blur_px << "; haze " << calm.quality.haze_px << ", " << hazy.quality.haze_px << " of "
                 << hazy.haze_px << ", " << soft.quality.haze_px);
    // Scale that hides the rim in part makes it look up to 0.3 px softer, in frames as small as these.
    CHECK(calm.quality.blur_px == Approx(0.8).margin(0.3));
    CHECK(hazy.quality.blur_px == Approx(0.8).margin(0.3));
    CHECK(soft.quality.blur_px == Approx(1.5).margin(0.3));
    // Half of the haze here has waves longer than a fifth of the diameter; 0.08 to 0.16 px are the body's own.
    CHECK(calm.quality.haze_px < 0.2);
    CHECK(hazy.quality.haze_px > 1.5 * calm.quality.haze_px);
    CHECK(hazy.quality.haze_px == Approx(0.6 * hazy.haze_px).epsilon(0.4));
  }
}

}  // namespace imprint
