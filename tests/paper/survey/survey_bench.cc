// The survey of a large field as in [B] 2.2 and 3.1: 40 targets in 6 x 6 x 2 m and two scale bars, photographed by hand
// with a 24 mm lens and 12 megapixels; all photographs, then half of them, against the coordinates rendered.
#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "lib/config/atomic_file.h"
#include "lib/targets/target_field.h"
#include "node/detect/detect_config.h"
#include "node/detect/detect_targets.h"
#include "simulation/field_photos.h"
#include "survey/survey.h"
#include "tests/unit/survey/photographed_field.h"

namespace {

using namespace imprint;
namespace fs = std::filesystem;

struct Photographed {
  FieldPhotos field;
  std::vector<SurveyPhoto> photos;
};

Result<Photographed> take_photos(const FieldPhotosScene& scene, const std::string& keep) {
  auto field = lay_out_field(scene);
  if (!field) return pass_on(field.error());
  Photographed result{std::move(*field), {}};
  const TargetLibrary& codes = result.field.layout.library;
  double render_s = 0.0, detect_s = 0.0;
  for (int k = 0; k < scene.photos; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    const auto image = render_field_photo(result.field, k);
    if (!image) return pass_on(image.error());
    const auto rendered = std::chrono::steady_clock::now();
    const std::string name = fmt::format("photo{:02}.png", k);
    result.photos.push_back({name, detect_targets(*image, codes, DetectConfig{})});
    detect_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - rendered).count();
    render_s += std::chrono::duration<double>(rendered - begin).count();
    if (!keep.empty()) cv::imwrite((fs::path(keep) / name).string(), *image, {cv::IMWRITE_PNG_COMPRESSION, 1});
  }
  fmt::print("seed {}: {} photographs rendered in {:.0f} s, targets found in {:.1f} s\n", scene.seed, scene.photos,
             render_s, detect_s);
  return result;
}

// What `imprint survey` needs beside the photographs, and the truth.
Result<void> keep_files(const FieldPhotos& field, const fs::path& folder) {
  TargetField truth;
  for (const Plate& plate : field.layout.plates) truth.targets[plate.code.id] = {plate.center_world_mm, std::nullopt};
  std::string bars = "id_a,id_b,length_mm,sigma_mm\n";
  for (const FieldBar& bar : field.bars) bars += fmt::format("{},{},{:.6f},0.01\n", bar.id_a, bar.id_b, bar.length_mm);
  if (auto written = write_target_field(truth, folder / "truth.csv"); !written) return written;
  if (auto written = write_target_library(field.layout.library, folder / "library.json"); !written) return written;
  return write_file_atomically(folder / "bars.csv", bars);
}

void print_survey(const std::string& name, const Photographed& taken, std::vector<SurveyPhoto> photos) {
  SurveyInput input;
  const CameraModel camera = reflex_camera();
  input.camera.id = "survey";
  input.camera.width_px = camera.width_px;
  input.camera.height_px = camera.height_px;
  input.camera.pixel_pitch_um = camera.pixel_pitch_um;
  input.camera.principal_point = {0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)};
  input.photos = std::move(photos);
  for (const FieldBar& bar : taken.field.bars) input.bars.push_back({bar.id_a, bar.id_b, bar.length_mm, 0.01});
  const auto begin = std::chrono::steady_clock::now();
  const auto survey = survey_field(input, SurveyConfig{});
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!survey) {
    fmt::print("  {}: {}\n", name, survey.error().message);
    return;
  }
  std::vector<Eigen::Vector3d> measured, truth;
  std::vector<double> sigmas;
  for (const Plate& plate : taken.field.layout.plates) {
    const auto target = survey->targets.find(plate.code.id);
    if (target == survey->targets.end()) continue;
    measured.push_back(target->second.p_world_mm);
    truth.push_back(plate.center_world_mm);
    sigmas.push_back(target->second.sigma_mm());
  }
  const Similarity fit = fit_points(measured, truth, false), free = fit_points(measured, truth, true);
  double stated = 0.0, largest = 0.0;
  int inside = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const Eigen::Vector3d error = fit(measured[i]) - truth[i];
    stated += 3.0 * sigmas[i] * sigmas[i];
    largest = std::max(largest, error.norm());
    for (int k = 0; k < 3; ++k) inside += std::abs(error[k]) < 1.96 * sigmas[i] ? 1 : 0;
  }
  int needy = 0;
  for (const auto& [id, target] : survey->targets) needy += target.needs.empty() ? 0 : 1;
  const auto count = static_cast<double>(measured.size());
  fmt::print(
      "  {}: {} of {} targets, RMS {:.4f} mm after a rigid best fit (stated {:.4f}), largest {:.3f} mm, scale {:+.1f} "
      "ppm, 95 % intervals hold {:.0f} %; reprojection RMS {:.4f} px over {} sights, {} left out; {} targets need more "
      "photographs; {:.1f} s\n",
      name, measured.size(), taken.field.layout.plates.size(), fit.rms, std::sqrt(stated / count), largest,
      1e6 * (1.0 / free.scale - 1.0), 100.0 * inside / (3.0 * count), survey->reprojection_rms_px, survey->observations,
      survey->rejected.size(), needy, elapsed_s);
}

}  // namespace

int main(int argc, char** argv) {
  FieldPhotosScene scene;
  scene.camera = reflex_camera();
  scene.backdrop.level = 0.06;
  std::string keep;
  int seeds = 1;
  CLI::App app("The survey of a large target field, paper B sections 2.2 and 3.1");
  app.add_option("--photos", scene.photos, "photographs")->check(CLI::Range(4, 99));
  app.add_option("--targets", scene.targets, "targets, the bars' ends aside")->check(CLI::Range(8, 56));
  app.add_option("--first-seed", scene.seed, "of field, walk and noise");
  app.add_option("--seeds", seeds, "fields to survey")->check(CLI::Range(1, 100));
  app.add_option("--keep", keep, "folder for photographs, library.json, bars.csv and truth.csv of the last field")
      ->check(CLI::ExistingDirectory);
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  fmt::print("[B] table 2, by TRITOP: repeatability RMS 0.237 mm, largest 0.644 mm; goal RMS 0.05 mm\n");
  for (int i = 0; i < seeds; ++i, ++scene.seed) {
    const auto taken = take_photos(scene, keep);
    if (!taken) {
      fmt::print(stderr, "{}\n", taken.error().message);
      return 1;
    }
    print_survey(fmt::format("all {} photographs", scene.photos), *taken, taken->photos);
    std::vector<SurveyPhoto> half;
    for (std::size_t k = 0; k < taken->photos.size(); k += 2) half.push_back(taken->photos[k]);
    print_survey(fmt::format("{} of them", half.size()), *taken, half);
    if (!keep.empty()) {
      if (const auto written = keep_files(taken->field, keep); !written) {
        fmt::print(stderr, "{}\n", written.error().message);
        return 1;
      }
    }
    std::fflush(stdout);
  }
  return 0;
}
