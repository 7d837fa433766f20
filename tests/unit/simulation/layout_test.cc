#include "simulation/layout.h"

#include <bit>
#include <set>

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "simulation/code_set.h"
#include "simulation/plate_layout.h"
#include "simulation/simulation.h"

namespace imprint {
namespace {

int rotation_invariant_distance(std::uint32_t a, std::uint32_t b, int bits) {
  int smallest = bits;
  const std::uint32_t mask = (1U << bits) - 1U;
  for (int k = 0; k < bits; ++k) {
    smallest = std::min(smallest, std::popcount((((a << k) | (a >> (bits - k))) & mask) ^ b));
  }
  return smallest;
}

}  // namespace

TEST_CASE("code set: any two codes differ by the stated distance in every rotation") {
  const TargetLibrary library = scene_library();
  REQUIRE(library.codes.size() == 60);
  int smallest = library.bits;
  for (std::size_t i = 0; i < library.codes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      smallest =
          std::min(smallest, rotation_invariant_distance(library.codes[i].code, library.codes[j].code, library.bits));
    }
  }
  CHECK(smallest == library.min_distance);
}

TEST_CASE("layout: every camera of the ready scenes reads about twenty plates, for many seeds") {
  for (const char* path : {IMPRINT_SCENES "/forge.toml", IMPRINT_SCENES "/laboratory.toml"}) {
    auto scene = read_scene(path);
    REQUIRE(scene);
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      scene->seed = seed;
      const auto layout = lay_out(*scene);
      REQUIRE(layout);
      std::set<int> ids;
      for (const Plate& plate : layout->plates) CHECK(ids.insert(plate.code.id).second);
      for (std::size_t c = 0; c < scene->cameras.size(); ++c) {
        const auto seen = std::count_if(layout->plates.begin(), layout->plates.end(), [&](const Plate& plate) {
          return plate_readable(plate, scene->targets.plate_mm, scene->cameras[c].model, layout->poses[c]);
        });
        CHECK(seen >= 18);
      }
    }
  }
}

TEST_CASE("layout: a camera looks at its point, its x axis level but for the roll") {
  auto scene = read_scene(IMPRINT_SCENES "/forge.toml");
  REQUIRE(scene);
  SceneCamera camera = scene->cameras[0];
  camera.roll_deg = 0.0;
  const CameraPose pose = camera_pose(camera);
  const Eigen::Vector3d aim = pose.cam_from_world(camera.aim_world_mm);
  CHECK(aim.head<2>().norm() < 1e-9);
  CHECK(aim.z() > 0.0);
  CHECK(std::abs(pose.R_cam_world(0, 2)) < 1e-12);
  CHECK(pose.R_cam_world(1, 2) < 0.0);  // y of the image points down
  CHECK(pose.R_cam_world.determinant() == Approx(1.0));
}

}  // namespace imprint
