#include "node/replay/imprint_replay.h"

#include <cstring>
#include <utility>

#include "lib/config/atomic_file.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

class ImprintReplay final : public FrameSource {
 public:
  ImprintReplay(std::filesystem::path folder, std::string camera_id)
      : folder_(std::move(folder)), camera_id_(std::move(camera_id)) {}

  Result<Frame> capture(const CaptureRequest& request) override {
    const auto file = folder_ / fmt::format("obs{:02}_{}.imprint", request.observation, camera_id_);
    const auto bytes = read_file(file);
    if (!bytes) return pass_on(bytes.error());
    if (bytes->empty()) return invalid_input("{}: expected an imprint, found an empty file", file.string());
    Frame frame;
    frame.source = file.string();
    frame.image.create(1, static_cast<int>(bytes->size()), CV_8UC1);  // one row: the bytes as they are
    std::memcpy(frame.image.data, bytes->data(), bytes->size());
    return frame;
  }

 private:
  std::filesystem::path folder_;
  std::string camera_id_;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_imprint_replay(const std::filesystem::path& folder,
                                                         const std::string& camera_id) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    return invalid_input("{}: expected a folder with obs<NN>_{}.imprint", folder.string(), camera_id);
  }
  return std::make_unique<ImprintReplay>(folder, camera_id);
}

ProcessedFrame replayed_imprint(const Frame& frame) {
  ProcessedFrame processed;
  auto imprint = decode_imprint({frame.image.data, frame.image.total()});
  if (imprint) {
    processed.imprint = std::move(*imprint);
  } else {
    processed.error = Error{ErrorKind::invalid_input, frame.source + ": " + imprint.error().message};
  }
  return processed;
}

}  // namespace imprint
