#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

#include "lib/result/result.h"

namespace imprint {

struct Scene;  // in scene.h: everything a scene file says, read and checked

/// Reads a scene file (docs/scene.md). Faults name the file, the line and the key.
Result<Scene> read_scene(const std::filesystem::path& path);

/// One frame, 16 bit or 8 bit as the scene says; depends on nothing but the scene, so that it can be made again.
Result<cv::Mat> render_frame(const Scene& scene, int observation, std::string_view camera_id);

/// Called with what is being made and how far it is, 0 to 1; from one thread at a time.
using SimulationProgress = std::function<void(std::string_view what, double done)>;

/// Writes library.json, field.csv, camN.toml, rig.toml, the images, truth.json and, last of all, session.toml into
/// `folder`, which is made if need be. Each file appears whole or not at all. `jobs` frames are rendered at a time;
/// their number changes no byte.
Result<void> write_simulation(const Scene& scene, const std::filesystem::path& folder,
                              const SimulationProgress& progress, int jobs = 1);

}  // namespace imprint
