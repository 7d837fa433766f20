#include "node/capture/frame_source.h"

#include "node/capture/file_source.h"
#include "node/capture/simulation_source.h"

namespace imprint {

Result<std::unique_ptr<FrameSource>> open_frame_source(std::string_view source, const std::filesystem::path& path,
                                                       const std::string& camera_id) {
  if (source == "folder") return open_folder_source(path, camera_id);
  if (source == "session") return open_session_source(path, camera_id);
  if (source == "simulation") return open_simulation_source(path, camera_id);
  return invalid_input("frame source \"{}\": expected folder, session or simulation", source);
}

}  // namespace imprint
