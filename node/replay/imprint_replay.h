#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "lib/result/result.h"
#include "node/capture/frame_source.h"
#include "node/node_pipeline.h"

namespace imprint {

/// Ready imprints in place of pictures, to try a line without the work of its nodes: observation NN is the wire bytes
/// in `<folder>/obs<NN>_<camera>.imprint`. Fails (invalid_input) when there is no such folder.
Result<std::unique_ptr<FrameSource>> open_imprint_replay(const std::filesystem::path& folder,
                                                         const std::string& camera_id);

/// The imprint that a frame of `open_imprint_replay` holds.
ProcessedFrame replayed_imprint(const Frame& frame);

}  // namespace imprint
