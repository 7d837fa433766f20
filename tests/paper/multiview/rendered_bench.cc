// Rendered forgings through the whole system, from their pictures to the geometry: errors against the truth of
// simulated sessions (`imprint simulate`) after 1 to all of their observations, and with two of the cameras.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include "cli/truth_comparison.h"
#include "fusion/fusion_pipeline.h"
#include "lib/rig/session_file.h"
#include "node/capture/image_file.h"
#include "node/node_pipeline.h"

namespace {

using namespace imprint;

struct Seen {
  ForgingSpec forging;
  std::vector<Observation> observations;
};

Result<Seen> see(const std::filesystem::path& session_file) {
  std::vector<std::string> warnings;
  const auto session = read_session_file(session_file, warnings);
  if (!session) return pass_on(session.error());
  const auto rig = read_rig(session->rig);
  if (!rig) return pass_on(rig.error());
  Seen seen{rig->forging, {}};
  for (const SessionObservation& files : session->observations) {
    Observation observation{static_cast<int>(seen.observations.size()), files.rotation_deg, {}, {}};
    for (const CameraModel& camera : rig->cameras) {
      const auto frame = read_image(files.images.at(camera.id), &warnings);
      if (!frame) return pass_on(frame.error());
      observation.imprints.push_back(process_frame(*frame, camera, *rig, EdgeMethod::best).imprint);
    }
    seen.observations.push_back(std::move(observation));
  }
  return seen;
}

/// Squared errors, or shares, summed over the forgings.
struct Errors {
  double axis = 0.0, diameter = 0.0, diameter90 = 0.0, circularity = 0.0, length = 0.0;
  double axis_covered = 0.0, diameter_covered = 0.0, circularity_covered = 0.0, length_covered = 0.0;
  double axis_ci95 = 0.0, diameter_ci95 = 0.0, circularity_ci95 = 0.0;
  int count = 0;

  void add(const Measurement& m, const TruthComparison& truth) {
    axis += std::pow(truth.axis_rms_mm, 2);
    diameter += std::pow(truth.diameter_rms_mm, 2);
    diameter90 += std::pow(truth.diameter_rms_best90_mm, 2);
    // [D]: mean and sigma of the sections' errors.
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < m.sections.size(); ++i) {
      const double error = m.sections[i].circularity_mm - truth.sections[i].circularity_mm;
      sum += error, squares += error * error;
      axis_ci95 += m.sections[i].axis_ci95_mm / static_cast<double>(m.sections.size());
      diameter_ci95 += m.sections[i].diameter_ci95_mm / static_cast<double>(m.sections.size());
      circularity_ci95 += m.sections[i].circularity_ci95_mm / static_cast<double>(m.sections.size());
    }
    const double mean = sum / static_cast<double>(m.sections.size());
    circularity += std::abs(mean) + std::sqrt(squares / static_cast<double>(m.sections.size()) - mean * mean);
    length += std::pow(m.length_mm - truth.length_mm, 2);
    axis_covered += truth.axis_covered;
    diameter_covered += truth.diameter_covered;
    circularity_covered += truth.circularity_covered;
    length_covered += std::abs(m.length_mm - truth.length_mm) <= m.length_ci95_mm ? 1.0 : 0.0;
    ++count;
  }
};

void print(const std::string& name, const Errors& e) {
  const auto rms = [&](double squares) { return std::sqrt(squares / e.count); };
  fmt::print(
      "  {:<18} {:>7.3f} {:>7.3f} {:>9.3f} {:>8.3f} {:>8.3f} | {:>5.1f} {:>5.1f} {:>5.1f} {:>5.0f} | {:>6.3f} "
      "{:>6.3f} {:>6.3f}\n",
      name, rms(e.axis), rms(e.diameter), rms(e.diameter90), e.circularity / e.count, rms(e.length),
      100.0 * e.axis_covered / e.count, 100.0 * e.diameter_covered / e.count, 100.0 * e.circularity_covered / e.count,
      100.0 * e.length_covered / e.count, e.axis_ci95 / e.count, e.diameter_ci95 / e.count,
      e.circularity_ci95 / e.count);
}

Result<void> run(const std::vector<std::filesystem::path>& folders) {
  std::map<std::string, Errors> joint, thesis;
  std::vector<std::string> order;
  const auto add = [&](const std::string& name, const std::vector<Observation>& observations, const Seen& seen,
                       const std::filesystem::path& folder) -> Result<void> {
    for (const GeometryMethod geometry : {GeometryMethod::joint, GeometryMethod::thesis}) {
      const auto measured = fuse(observations, seen.forging, folder.filename(), "best", geometry);
      if (!measured) return pass_on(measured.error());
      const auto truth = compare_with_truth(*measured, folder / "truth.json");
      if (!truth) return pass_on(truth.error());
      if (std::ranges::find(order, name) == order.end()) order.push_back(name);
      (geometry == GeometryMethod::joint ? joint : thesis)[name].add(*measured, *truth);
    }
    return {};
  };
  for (const std::filesystem::path& folder : folders) {
    const auto seen = see(folder / "session.toml");
    if (!seen) return pass_on(seen.error());
    const auto& all = seen->observations;
    for (const std::size_t n : {1, 2, 3, 4, 6, 8, 11})
      if (n <= all.size())
        if (auto done = add(fmt::format("{} obs.", n), {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(n)},
                            *seen, folder);
            !done)
          return done;
    std::vector<Observation> two(all.begin(), all.begin() + 1);
    two.front().imprints.resize(2);
    if (auto done = add("1 obs., 2 cameras", two, *seen, folder); !done) return done;
    fmt::print(stderr, "{}\n", folder.string());
  }
  for (const auto* table : {&joint, &thesis}) {
    fmt::print("\n{}: {} rendered forgings, mm and %\n", table == &joint ? "joint" : "thesis", folders.size());
    fmt::print("  {:<18} {:>7} {:>7} {:>9} {:>8} {:>8} | {:^24} | {:^20}\n", "", "axis", "diam.", "best 90 %", "circ.",
               "length", "95 % hold: a / d / c / l", "half-widths a / d / c");
    for (const std::string& name : order) print(name, table->at(name));
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::filesystem::path> folders;
  CLI::App app{"Rendered forgings against their truth, from pictures to geometry"};
  app.add_option("folder", folders, "of `imprint simulate`: session.toml and truth.json")->required();
  CLI11_PARSE(app, argc, argv);
  if (const auto done = run(folders); !done) {
    fmt::print(stderr, "rendered_bench: {}\n", done.error().message);
    return done.error().exit_status();
  }
  return 0;
}
