#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "lib/result/result.h"
#include "node/capture/frame_source.h"

namespace imprint {

/// Pictures of a folder: `obs<NN>_<camera>.png` (or .tif, .tiff) for the triggered observation, whatever the session.
/// Fails (invalid_input) when the folder is not there.
Result<std::unique_ptr<FrameSource>> open_folder_source(const std::filesystem::path& folder,
                                                        const std::string& camera_id);

/// Pictures of a `session.toml`: what it names for the triggered observation. Where file and trigger disagree on the
/// rotation the frame carries a warning; the trigger counts. Fails (invalid_input) when the file cannot be read or
/// has no picture of this camera.
Result<std::unique_ptr<FrameSource>> open_session_source(const std::filesystem::path& file,
                                                         const std::string& camera_id);

}  // namespace imprint
