#include <filesystem>

#include <unistd.h>

#include <catch2/catch.hpp>

#include "lib/rig/rig.h"
#include "node/capture/exposure_control.h"
#include "node/capture/simulation_source.h"
#include "node/node_pipeline.h"
#include "simulation/scene.h"
#include "simulation/simulation.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using Catch::Matchers::Contains;

// The small forge, its light `exposure` times what its file says, as a simulated camera and its rig see it.
class BrightForge {
 public:
  explicit BrightForge(double exposure) {
    std::ifstream file(IMPRINT_TEST_DATA "/small_forge.toml");
    std::string text(std::istreambuf_iterator<char>(file), {});
    const std::string before = "vignetting = 0.2";
    text.replace(text.find(before), before.size(), fmt::format("{}\nexposure = {:#}", before, exposure));
    const auto path = folder_.write("scene.toml", text);
    auto scene = read_scene(path);
    REQUIRE(scene);
    scene->observations.rotations_deg = {0.0};
    scene->cameras.resize(1);
    REQUIRE(write_simulation(
        *scene, folder_.path(), [](std::string_view, double) {}, 1));
    rig_ = *read_rig(folder_ / "rig.toml");
    auto source = open_simulation_source(path, "cam1");
    REQUIRE(source);
    source_ = std::move(*source);
  }

  Imprint take(const ExposureConfig& config) {
    const auto frame = source_->capture({"S", 0, 0.0});
    REQUIRE(frame);
    const Imprint imprint = process_frame(*frame, rig_.cameras.front(), rig_, EdgeMethod::best).imprint;
    REQUIRE(imprint.failure.empty());
    decision_ =
        next_exposure(config, frame->exposure, {imprint.quality.body_level, imprint.quality.saturated_fraction});
    if (decision_.changed) REQUIRE(source_->adjustable_exposure()->set_exposure(decision_.next));
    return imprint;
  }
  [[nodiscard]] const ExposureDecision& decision() const { return decision_; }

 private:
  TemporaryFolder folder_;
  Rig rig_;
  std::unique_ptr<FrameSource> source_;
  ExposureDecision decision_;
};

}  // namespace

TEST_CASE("exposure loop: a rendered body three times too bright is out of saturation within three frames") {
  BrightForge forge(3.0);
  const Imprint first = forge.take({});
  CHECK(first.quality.saturated_fraction > 0.3);
  REQUIRE_FALSE(first.warnings.empty());
  CHECK_THAT(first.warnings.back(), Contains("of the forging is saturated"));
  (void)forge.take({});
  const Imprint third = forge.take({});
  CHECK(third.quality.saturated_fraction < 0.005);
  CHECK(third.quality.body_level > 0.4);
  CHECK(third.quality.body_level < 0.92);
  CHECK_FALSE(forge.decision().changed);
  for (const std::string& warning : third.warnings) CHECK_THAT(warning, !Contains("saturated"));
}

TEST_CASE("exposure loop: a rendered body too bright for the shortest exposure is reported") {
  BrightForge forge(3.0);
  ExposureConfig config;
  config.min_time_us = 800.0;
  (void)forge.take(config);
  CHECK(forge.take(config).quality.saturated_fraction > 0.1);
  CHECK(forge.decision().alarm == "cannot hold the body out of saturation: exposure at its minimum 800 us");
}

}  // namespace imprint
