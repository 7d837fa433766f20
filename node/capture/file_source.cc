#include "node/capture/file_source.h"

#include <algorithm>
#include <cmath>

#include "lib/rig/rig.h"
#include "node/capture/image_file.h"

namespace imprint {
namespace {

constexpr double kSameRotationDeg = 1e-3;

Result<Frame> read_frame(const std::filesystem::path& path) {
  std::vector<std::string> warnings;
  auto frame = read_image(path, &warnings);
  if (frame) frame->warnings.insert(frame->warnings.end(), warnings.begin(), warnings.end());
  return frame;
}

class FolderSource final : public FrameSource {
 public:
  FolderSource(std::filesystem::path folder, std::string camera_id)
      : folder_(std::move(folder)), camera_id_(std::move(camera_id)) {}

  Result<Frame> capture(const CaptureRequest& request) override {
    const std::string stem = fmt::format("obs{:02}_{}", request.observation, camera_id_);
    for (const char* extension : {".png", ".tif", ".tiff"}) {
      const std::filesystem::path path = folder_ / (stem + extension);
      std::error_code ignored;
      if (std::filesystem::exists(path, ignored)) return read_frame(path);
    }
    return invalid_input("{}: no {}.png, .tif or .tiff for the triggered observation", folder_.string(), stem);
  }

 private:
  std::filesystem::path folder_;
  std::string camera_id_;
};

class SessionSource final : public FrameSource {
 public:
  SessionSource(std::filesystem::path file, SessionFile session, std::string camera_id)
      : file_(std::move(file)), session_(std::move(session)), camera_id_(std::move(camera_id)) {}

  Result<Frame> capture(const CaptureRequest& request) override {
    if (request.observation < 0 || static_cast<std::size_t>(request.observation) >= session_.observations.size()) {
      return invalid_input("{}: has {} observation(s), triggered was number {}", file_.string(),
                           session_.observations.size(), request.observation);
    }
    const SessionObservation& observation = session_.observations[static_cast<std::size_t>(request.observation)];
    const auto image = observation.images.find(camera_id_);
    if (image == observation.images.end()) {
      return invalid_input("{}: observation {} names no image of {}", file_.string(), request.observation, camera_id_);
    }
    auto frame = read_frame(image->second);
    if (frame && std::abs(observation.rotation_deg - request.rotation_deg) > kSameRotationDeg) {
      frame->warnings.push_back(fmt::format("{} says rotation {} deg, the trigger {} deg; the trigger's is used",
                                            file_.filename().string(), observation.rotation_deg, request.rotation_deg));
    }
    return frame;
  }

 private:
  std::filesystem::path file_;
  SessionFile session_;
  std::string camera_id_;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_folder_source(const std::filesystem::path& folder,
                                                        const std::string& camera_id) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    return invalid_input("{}: expected a folder with the pictures of {}, found none", folder.string(), camera_id);
  }
  return std::make_unique<FolderSource>(folder, camera_id);
}

Result<std::unique_ptr<FrameSource>> open_session_source(const std::filesystem::path& file,
                                                         const std::string& camera_id) {
  auto session = read_session_file(file);
  if (!session) return pass_on(session.error());
  if (std::ranges::none_of(session->observations, [&](const auto& o) { return o.images.contains(camera_id); })) {
    return invalid_input("{}: names no image of {}", file.string(), camera_id);
  }
  return std::make_unique<SessionSource>(file, std::move(*session), camera_id);
}

}  // namespace imprint
