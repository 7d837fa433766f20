#include "node/capture/simulation_source.h"

#include "simulation/scene.h"
#include "simulation/simulation.h"

namespace imprint {
namespace {

class SimulationSource final : public FrameSource {
 public:
  SimulationSource(std::string name, Scene scene, std::string camera_id)
      : name_(std::move(name)), scene_(std::move(scene)), camera_id_(std::move(camera_id)) {}

  Result<Frame> capture(const CaptureRequest& request) override {
    auto image = render_frame(scene_, request.observation, camera_id_);
    if (!image) return pass_on(image.error());
    Frame frame;
    frame.image = std::move(*image);
    frame.source = fmt::format("{} observation {} {}", name_, request.observation, camera_id_);
    return frame;
  }

 private:
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
