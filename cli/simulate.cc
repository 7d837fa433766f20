#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include <unistd.h>

#include "cli/command.h"
#include "cli/command_line.h"
#include "simulation/scene.h"
#include "simulation/simulation.h"

namespace imprint {
namespace {

struct SimulateOptions {
  std::string scene;
  std::string folder;
  int jobs = 1;
  std::optional<std::int64_t> seed;
  std::optional<std::size_t> observations;
};

// One line that is rewritten on a terminal, a line a frame elsewhere.
void show_progress(std::string_view what, double done) {
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  constexpr int width = 30;
  const int filled = static_cast<int>(done * width);
  if (terminal) {
    std::cerr << fmt::format("\r[{:#<{}}{:.<{}}] {:3.0f} % {}   ", "", filled, "", width - filled, 100.0 * done, what);
    if (done >= 1.0) std::cerr << '\n';
  } else {
    std::cerr << fmt::format("{:3.0f} % {}\n", 100.0 * done, what);
  }
}

int simulate(const SimulateOptions& options, bool json) {
  const auto started = std::chrono::steady_clock::now();
  auto scene = read_scene(options.scene);
  if (!scene) return fail(scene.error());
  if (options.seed) scene->seed = static_cast<std::uint64_t>(*options.seed);
  if (options.observations) {
    auto& rotations = scene->observations.rotations_deg;
    if (*options.observations > rotations.size()) {
      return fail({ErrorKind::invalid_input, fmt::format("--observations {}: {} has only {}", *options.observations,
                                                         options.scene, rotations.size())});
    }
    rotations.resize(*options.observations);
  }
  const auto written = write_simulation(*scene, options.folder, show_progress, options.jobs);
  if (!written) return fail(written.error());
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  const std::filesystem::path folder = options.folder;
  const auto frames = scene->cameras.size() * scene->observations.rotations_deg.size();
  if (json) {
    nlohmann::json document{{"session", (folder / "session.toml").string()},
                            {"truth", (folder / "truth.json").string()},
                            {"seed", scene->seed},
                            {"observations", scene->observations.rotations_deg.size()},
                            {"frames", frames},
                            {"elapsed_s", elapsed_s},
                            {"cameras", nlohmann::json::array()}};
    for (const SceneCamera& camera : scene->cameras) document["cameras"].push_back(camera.model.id);
    return print_json(document);
  }
  std::cout << fmt::format("{} frames in {:.1f} s; measure them with: imprint measure {}\n", frames, elapsed_s,
                           (folder / "session.toml").string());
  return 0;
}

}  // namespace

void add_simulate_command(Cli& cli) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App* command = cli.command(cli.app, "simulate", "renders a rig, its targets and a forging with known truth",
                                  [&cli, options] { return simulate(*options, cli.json); });
  command->add_option("scene", options->scene, "scene file (docs/scene.md)")->required();
  command->add_option("--out", options->folder, "folder for images, rig, session and truth; made if need be")
      ->required();
  command->add_option("--jobs", options->jobs, "frames rendered at a time")->check(between(1, 256));
  command->add_option("--observations", options->observations, "only the first so many of the scene's observations")
      ->check(between(1, 1000));
  command->add_option("--seed", options->seed, "another forging, hall and noise: overrides the scene's seed");
}

}  // namespace imprint
