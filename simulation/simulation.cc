#include "simulation/simulation.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "lib/camera/camera_file.h"
#include "lib/config/atomic_file.h"
#include "lib/targets/target_field.h"
#include "simulation/backdrop.h"
#include "simulation/frame_renderer.h"
#include "simulation/layout.h"
#include "simulation/truth.h"

namespace imprint {
namespace {

std::string image_name(int observation, const std::string& camera_id) {
  return fmt::format("obs{:02}_{}.png", observation, camera_id);
}

Result<void> write_image(const cv::Mat& image, const std::filesystem::path& path) {
  std::vector<unsigned char> bytes;
  try {
    // Noise does not compress: the fastest level loses little.
    if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1}))
      return job_failed("{}: the image cannot be encoded", path.string());
  } catch (const cv::Exception& error) {
    return job_failed("{}: the image cannot be encoded: {}", path.string(), error.what());
  }
  return write_file_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::string rig_toml(const Scene& scene) {
  std::string text = "field = \"field.csv\"\nlibrary = \"library.json\"\n";
  for (const SceneCamera& camera : scene.cameras) {
    text += fmt::format("\n[[camera]]\nid = \"{0}\"\ncalibration = \"{0}.toml\"\n", camera.model.id);
  }
  const ForgingSpec& spec = scene.spec;
  const Eigen::Vector3d& d = spec.axis_direction_world;
  text += fmt::format(
      "\n[forging]\ndiameter_mm = [{:#}, {:#}]\naxis_direction = [{:#}, {:#}, {:#}]\nend_section_mm = {:#}\npolarity = "
      "\"{}\"\n",
      spec.diameter_min_mm, spec.diameter_max_mm, d.x(), d.y(), d.z(), spec.end_section_mm,
      spec.polarity == Polarity::bright ? "bright" : "dark");
  return text;
}

std::string session_toml(const Scene& scene) {
  std::string text = "rig = \"rig.toml\"\n";
  for (std::size_t i = 0; i < scene.observations.rotations_deg.size(); ++i) {
    text += fmt::format("\n[[observation]]\nrotation_deg = {:#}\n[observation.images]\n",
                        scene.observations.rotations_deg[i]);
    for (const SceneCamera& camera : scene.cameras) {
      text += fmt::format("{} = \"{}\"\n", camera.model.id, image_name(static_cast<int>(i), camera.model.id));
    }
  }
  return text;
}

Result<void> write_rig(const Scene& scene, const Layout& layout, const std::filesystem::path& folder) {
  if (auto written = write_target_library(layout.library, folder / "library.json"); !written) return written;
  TargetField field;
  for (const Plate& plate : layout.plates) field.targets[plate.code.id] = {plate.center_world_mm, std::nullopt};
  if (auto written = write_target_field(field, folder / "field.csv"); !written) return written;
  for (const SceneCamera& camera : scene.cameras) {
    if (auto written = write_camera_file(camera.model, folder / (camera.model.id + ".toml")); !written) return written;
  }
  return write_file_atomically(folder / "rig.toml", rig_toml(scene));
}

// Renders all frames with several threads. Frames of one camera follow each other, so that its backdrop is painted
// once and given back when the last of them is done.
class FrameFactory {
 public:
  FrameFactory(const Scene& scene, const Layout& layout, const std::filesystem::path& folder,
               const SimulationProgress& progress)
      : scene_(scene), layout_(layout), folder_(folder), progress_(progress), backdrops_(scene.cameras.size()) {}

  Result<void> run(int jobs) {
    const int threads = std::clamp(jobs, 1, total());
    std::vector<std::thread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back([this] { work(); });
    work();
    for (std::thread& other : others) other.join();
    if (error_) return pass_on(*error_);
    return {};
  }

 private:
  struct Backdrop {
    std::mutex painting;
    cv::Mat image;
    int used = 0;
  };

  [[nodiscard]] int observations() const { return static_cast<int>(layout_.body_poses.size()); }
  [[nodiscard]] int total() const { return observations() * static_cast<int>(scene_.cameras.size()); }

  void work() {
    for (int frame = next_++; frame < total() && !failed_; frame = next_++) {
      const int camera = frame / observations(), observation = frame % observations();
      auto written = make_guarded(camera, observation);
      const std::lock_guard lock(report_);
      if (!written && !error_) error_ = written.error();
      failed_ = failed_ || !written;
      ++done_;
      if (progress_ && written) {
        progress_(image_name(observation, scene_.cameras[static_cast<std::size_t>(camera)].model.id),
                  static_cast<double>(done_) / total());
      }
    }
  }

  // Nothing may leave a thread but a value.
  Result<void> make_guarded(int camera, int observation) {
    try {
      return make(camera, observation);
    } catch (const std::exception& error) {
      return job_failed("{}: {}; are the images too large for this machine's memory?",
                        image_name(observation, scene_.cameras[static_cast<std::size_t>(camera)].model.id),
                        error.what());
    }
  }

  Result<void> make(int camera, int observation) {
    Backdrop& backdrop = backdrops_[static_cast<std::size_t>(camera)];
    cv::Mat behind;
    {
      const std::lock_guard lock(backdrop.painting);
      if (backdrop.image.empty()) backdrop.image = paint_backdrop(scene_, camera);
      behind = backdrop.image;
      if (++backdrop.used == observations()) backdrop.image.release();
    }
    const auto frame = render_frame_on(behind, scene_, layout_, observation, camera);
    if (!frame) return pass_on(frame.error());
    return write_image(*frame,
                       folder_ / image_name(observation, scene_.cameras[static_cast<std::size_t>(camera)].model.id));
  }

  const Scene& scene_;
  const Layout& layout_;
  const std::filesystem::path& folder_;
  const SimulationProgress& progress_;
  std::vector<Backdrop> backdrops_;
  std::atomic<int> next_{0};
  std::atomic<bool> failed_{false};
  std::mutex report_;
  int done_ = 0;
  std::optional<Error> error_;
};

}  // namespace

Result<cv::Mat> render_frame(const Scene& scene, int observation, std::string_view camera_id) {
  const int camera = scene.camera_index(camera_id);
  const int observations = static_cast<int>(scene.observations.rotations_deg.size());
  if (camera < 0) return invalid_input("scene \"{}\": has no camera \"{}\"", scene.name, camera_id);
  if (observation < 0 || observation >= observations) {
    return invalid_input("scene \"{}\": has observations 0 to {}, asked for {}", scene.name, observations - 1,
                         observation);
  }
  const auto layout = lay_out(scene);
  if (!layout) return pass_on(layout.error());
  return render_frame_on(paint_backdrop(scene, camera), scene, *layout, observation, camera);
}

Result<void> write_simulation(const Scene& scene, const std::filesystem::path& folder,
                              const SimulationProgress& progress, int jobs) {
  const auto layout = lay_out(scene);
  if (!layout) return pass_on(layout.error());
  const auto truth = truth_json(scene, *layout);
  if (!truth) return pass_on(truth.error());
  std::error_code fault;
  std::filesystem::create_directories(folder, fault);
  if (fault) return invalid_input("{}: the folder cannot be made: {}", folder.string(), fault.message());
  // The session names all the rest: it is absent until everything it names is there.
  std::filesystem::remove(folder / "session.toml", fault);
  if (fault) return invalid_input("{}: cannot be replaced: {}", (folder / "session.toml").string(), fault.message());
  if (auto written = write_rig(scene, *layout, folder); !written) return written;
  if (auto written = write_file_atomically(folder / "truth.json", *truth); !written) return written;
  if (auto written = FrameFactory(scene, *layout, folder, progress).run(jobs); !written) return written;
  return write_file_atomically(folder / "session.toml", session_toml(scene));
}

}  // namespace imprint
