#include "node/capture/simulation_source.h"

#include <cmath>

#include "simulation/scene.h"
#include "simulation/simulation.h"

namespace imprint {
namespace {

class SimulationSource final : public FrameSource, public AdjustableExposure {
 public:
  SimulationSource(std::string name, Scene scene, std::string camera_id)
      : name_(std::move(name)), scene_(std::move(scene)), camera_id_(std::move(camera_id)) {}

  Result<Frame> capture(const CaptureRequest& request) override {
    auto image = render_frame(exposed_scene(), request.observation, camera_id_);
    if (!image) return pass_on(image.error());
    Frame frame;
    frame.image = std::move(*image);
    frame.source = fmt::format("{} observation {} {}", name_, request.observation, camera_id_);
    frame.exposure = exposure_;
    return frame;
  }

  AdjustableExposure* adjustable_exposure() override { return this; }
  [[nodiscard]] Exposure exposure() const override { return exposure_; }
  Result<void> set_exposure(const Exposure& exposure) override {
    if (!(exposure.time_us > 0.0 && exposure.time_us <= 1e8 && std::abs(exposure.gain_db) <= 60.0))
      return job_failed("{} {}: cannot expose for {} us at {} dB", name_, camera_id_, exposure.time_us,
                        exposure.gain_db);
    exposure_ = exposure;
    return {};
  }

 private:
  // Gain amplifies light and noise alike: full scale is reached with fewer electrons.
  [[nodiscard]] Scene exposed_scene() const {
    const double gain = std::pow(10.0, exposure_.gain_db / 20.0);
    Scene scene = scene_;
    scene.imaging.exposure *= exposure_.time_us / kSceneExposureUs * gain;
    scene.imaging.full_well_e /= gain;
    return scene;
  }

  Exposure exposure_{kSceneExposureUs, 0.0};
  std::string name_;
  Scene scene_;
  std::string camera_id_;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_simulation_source(const std::filesystem::path& scene,
                                                            const std::string& camera_id) {
  auto read = read_scene(scene);
  if (!read) return pass_on(read.error());
  return std::make_unique<SimulationSource>(scene.string(), std::move(*read), camera_id);
}

}  // namespace imprint
