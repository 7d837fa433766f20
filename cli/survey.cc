#include <filesystem>
#include <set>

#include <fmt/core.h>

#include "cli/command.h"
#include "lib/camera/camera_file.h"
#include "node/capture/image_file.h"
#include "node/detect/detect_config.h"
#include "survey/survey.h"

namespace imprint {
namespace {

namespace fs = std::filesystem;

struct SurveyOptions {
  fs::path library, bars, out, dots, camera, camera_out, align;
  double focal_length_mm = 0.0, pixel_pitch_um = 0.0;
  std::optional<int> origin, x_axis, plane;
  bool without_bar_targets = false;
  std::vector<fs::path> photos;
};

// The camera as far as it is known; the size comes with the photographs.
Result<CameraModel> start_camera(const SurveyOptions& options) {
  if (!options.camera.empty()) return read_camera_file(options.camera);
  CameraModel camera;
  camera.id = "survey";
  const bool stated = options.focal_length_mm > 0.0 && options.pixel_pitch_um > 0.0;
  if (!stated && (options.focal_length_mm != 0.0 || options.pixel_pitch_um != 0.0))
    return invalid_input(
        "expected --focal-length-mm and --pixel-pitch-um both and above 0, or neither, found {} and {}",
        options.focal_length_mm, options.pixel_pitch_um);
  camera.pixel_pitch_um = stated ? options.pixel_pitch_um : 1.0;
  if (stated) camera.focal_length_px = 1000.0 * options.focal_length_mm / options.pixel_pitch_um;
  return camera;
}

Result<void> take_size(CameraModel& camera, const SurveyOptions& options, const fs::path& photo, const cv::Size& size) {
  const bool first = camera.width_px == 0;
  if (first) {
    camera.width_px = size.width;
    camera.height_px = size.height;
    camera.principal_point = {0.5 * (size.width - 1), 0.5 * (size.height - 1)};
  }
  if (size.width == camera.width_px && size.height == camera.height_px) return {};
  const std::string other = options.camera.empty() ? options.photos.front().string() : options.camera.string();
  const bool turned = size.width == camera.height_px && size.height == camera.width_px;
  return invalid_input("{}: is {} x {} px, but {} is {} x {}; all photographs must be of one camera{}", photo.string(),
                       size.width, size.height, other, camera.width_px, camera.height_px,
                       turned ? ", as its sensor reads them (not turned upright)" : "");
}

Result<SurveyInput> load(const SurveyOptions& options, const TargetLibrary& library) {
  auto camera = start_camera(options);
  if (!camera) return pass_on(camera.error());
  SurveyInput input;
  input.camera = std::move(*camera);
  for (const fs::path& path : options.photos) {
    std::vector<std::string> warnings;
    const auto frame = read_image(path, &warnings);
    if (!frame) return pass_on(frame.error());
    for (const std::string& warning : warnings) std::cerr << "imprint: warning: " << warning << '\n';
    if (auto taken = take_size(input.camera, options, path, frame->image.size()); !taken) return pass_on(taken.error());
    input.photos.push_back({path.string(), detect_targets(frame->image, library, DetectConfig{})});
  }
  return input;
}

Result<std::vector<ScaleBar>> load_bars(const SurveyOptions& options, const TargetLibrary& library) {
  auto bars = read_scale_bars(options.bars);
  if (!bars) return bars;
  std::set<int> known;
  for (const TargetCode& code : library.codes) known.insert(code.id);
  for (const ScaleBar& bar : *bars) {
    for (const int id : {bar.id_a, bar.id_b})
      if (known.count(id) == 0)
        return invalid_input("{}: the bar from {} to {}: target {} is not in {}", options.bars.string(), bar.id_a,
                             bar.id_b, id, options.library.string());
  }
  return bars;
}

nlohmann::json describe(const SurveyTarget& target, int id) {
  const Eigen::Vector3d& p = target.p_world_mm;
  nlohmann::json json{{"id", id},
                      {"x_mm", p.x()},
                      {"y_mm", p.y()},
                      {"z_mm", p.z()},
                      {"sigma_mm", target.sigma_mm()},
                      {"rays", target.rays},
                      {"angle_deg", target.angle_deg},
                      {"needs", target.needs}};
  json["covariance_mm2"] = std::vector<double>(target.covariance.data(), target.covariance.data() + 9);
  return json;
}

nlohmann::json describe(const Survey& survey, const std::vector<SurveyPhoto>& photos) {
  nlohmann::json json;
  json["targets"] = nlohmann::json::array();
  for (const auto& [id, target] : survey.targets) json["targets"].push_back(describe(target, id));
  json["seen_once"] = survey.seen_once;
  json["scale_bars"] = nlohmann::json::array();
  for (const SurveyBar& bar : survey.bars) {
    nlohmann::json entry{{"id_a", bar.bar.id_a},
                         {"id_b", bar.bar.id_b},
                         {"length_mm", bar.bar.length_mm},
                         {"sigma_mm", bar.bar.sigma_mm},
                         {"seen", bar.seen}};
    if (bar.seen) {
      entry["measured_mm"] = bar.measured_mm;
      entry["measured_sigma_mm"] = bar.measured_sigma_mm;
      entry["residual_mm"] = bar.measured_mm - bar.bar.length_mm;
    }
    json["scale_bars"].push_back(std::move(entry));
  }
  const CameraModel& camera = survey.camera;
  const BalancedDistortion& d = camera.distortion;
  json["camera"] = {{"focal_length_px", camera.focal_length_px},
                    {"principal_point_px", {camera.principal_point.x_px, camera.principal_point.y_px}},
                    {"radial", d.radial},
                    {"tangential", d.tangential},
                    {"affine", d.affine}};
  for (int i = 0; i < kInteriorTerms; ++i)
    json["camera"]["ci95"][std::string(kInteriorNames[static_cast<std::size_t>(i)])] =
        1.96 * std::sqrt(std::max(0.0, survey.interior_covariance(i, i)));
  std::vector<int> used(photos.size(), 0);
  for (const Sight& sight : survey.sights) used[sight.photo] += sight.used ? 1 : 0;
  json["photographs"] = nlohmann::json::array();
  for (std::size_t i = 0; i < photos.size(); ++i)
    json["photographs"].push_back({{"image", photos[i].name},
                                   {"found", photos[i].targets.size()},
                                   {"used", used[i]},
                                   {"left_out", !survey.poses[i].has_value()}});
  json["rejected"] = nlohmann::json::array();
  for (const RejectedSight& r : survey.rejected)
    json["rejected"].push_back({{"image", photos[r.photo].name}, {"id", r.id}, {"off_px", r.off_px}});
  json["datum"] = {{"description", survey.datum.description}};
  if (survey.datum.align_rms_mm) json["datum"]["align_rms_mm"] = *survey.datum.align_rms_mm;
  json["observations"] = survey.observations;
  json["reprojection_rms_px"] = survey.reprojection_rms_px;
  json["sigma_scale"] = survey.sigma_scale;
  json["warnings"] = survey.warnings;
  return json;
}

void print(const Survey& survey, const std::vector<SurveyPhoto>& photos) {
  int posed = 0;
  for (const auto& pose : survey.poses) posed += pose ? 1 : 0;
  fmt::print("{} targets from {} photographs: reprojection RMS {:.4f} px over {} sights, {} left out\n",
             survey.targets.size(), posed, survey.reprojection_rms_px, survey.observations, survey.rejected.size());
  fmt::print("frame: {}\n", survey.datum.description);
  if (survey.datum.align_rms_mm)
    fmt::print("  differs by {:.3f} mm RMS from the coordinates given\n", *survey.datum.align_rms_mm);
  for (const SurveyBar& bar : survey.bars)
    if (bar.seen)
      fmt::print("scale bar {} to {}: {:.4f} mm, stated {:.4f}: {:+.4f} mm\n", bar.bar.id_a, bar.bar.id_b,
                 bar.measured_mm, bar.bar.length_mm, bar.measured_mm - bar.bar.length_mm);
  fmt::print("{:>6} {:>11} {:>11} {:>11} {:>9} {:>5} {:>7}\n", "id", "x mm", "y mm", "z mm", "sigma mm", "rays",
             "angle");
  for (const auto& [id, t] : survey.targets)
    fmt::print("{:>6} {:>11.3f} {:>11.3f} {:>11.3f} {:>9.4f} {:>5} {:>5.0f} deg\n", id, t.p_world_mm.x(),
               t.p_world_mm.y(), t.p_world_mm.z(), t.sigma_mm(), t.rays, t.angle_deg);
  for (const RejectedSight& r : survey.rejected)
    fmt::print("  left out: {} target {}: {:.2f} px off: wrong id, dirty or moved\n", photos[r.photo].name, r.id,
               r.off_px);
  for (const auto& [id, t] : survey.targets)
    if (!t.needs.empty()) fmt::print("  needs more photographs: target {}: {}\n", id, t.needs);
  for (const int id : survey.seen_once)
    fmt::print("  not measured: target {}: fewer than two photographs from different places agree on it\n", id);
}

int run_survey(const SurveyOptions& options, bool as_json) {
  const auto library = read_target_library(options.library);
  if (!library) return fail(library.error());
  auto bars = load_bars(options, *library);
  if (!bars) return fail(bars.error());
  DatumChoice datum{options.origin, options.x_axis, options.plane, std::nullopt};
  if (!options.align.empty()) {
    auto nominal = read_target_field(options.align);
    if (!nominal) return fail(nominal.error());
    datum.align = std::move(*nominal);
  }
  auto input = load(options, *library);
  if (!input) return fail(input.error());
  input->bars = *bars;
  input->datum = std::move(datum);
  const auto survey = survey_field(*input, SurveyConfig{});
  if (!survey) return fail(survey.error());
  for (const std::string& warning : survey->warnings) std::cerr << "imprint: warning: " << warning << '\n';
  TargetField field = survey->field();
  if (options.without_bar_targets) {
    for (const ScaleBar& bar : *bars) field.targets.erase(bar.id_a), field.targets.erase(bar.id_b);
    if (field.targets.empty())
      return fail({ErrorKind::job_failed, "survey: only the targets of the scale bars are measured"});
  }
  if (auto written = write_target_field(field, options.out); !written) return fail(written.error());
  if (!options.dots.empty()) {
    DotDiscs dots = survey->dots;
    std::erase_if(dots, [&](const auto& dot) { return field.targets.count(dot.first) == 0; });
    if (auto written = write_dot_discs(dots, options.dots); !written) return fail(written.error());
  }
  if (!options.camera_out.empty()) {
    if (auto written = write_camera_file(survey->camera, options.camera_out); !written) return fail(written.error());
  }
  if (as_json) return print_json(describe(*survey, input->photos));
  print(*survey, input->photos);
  return 0;
}

}  // namespace

void add_survey_command(Cli& cli) {
  auto options = std::make_shared<SurveyOptions>();
  auto* command = cli.command(cli.app, "survey", "measures the target field from hand-held photographs and scale bars",
                              [options, &cli] { return run_survey(*options, cli.json); });
  command->add_option("--library", options->library, "library.json, the coded targets")->required();
  command->add_option("--scale-bars", options->bars, "bars.csv: id_a,id_b,length_mm,sigma_mm")->required();
  command->add_option("--out", options->out, "field.csv to write")->required();
  command->add_option("--dots", options->dots, "write size and normal of the dots: dots.csv of rig.toml and resect");
  auto* camera =
      command->add_option("--camera", options->camera, "camN.toml to start from; it is adjusted all the same");
  command->add_option("--focal-length-mm", options->focal_length_mm, "as engraved on the lens; found if not given")
      ->excludes(camera);
  command->add_option("--pixel-pitch-um", options->pixel_pitch_um, "side of a pixel; goes with --focal-length-mm")
      ->excludes(camera);
  command->add_option("--camera-out", options->camera_out, "write the camera found as camN.toml");
  auto* align = command->add_option("--align", options->align, "field.csv whose frame the result is fitted to");
  command->add_option("--origin", options->origin, "id of the target at the origin")->excludes(align);
  command->add_option("--x-axis", options->x_axis, "id of a target on the x axis")->excludes(align);
  command->add_option("--plane", options->plane, "id of a target in the xy plane, y > 0")->excludes(align);
  command->add_flag("--without-bar-targets", options->without_bar_targets,
                    "leave the ends of the scale bars out of field.csv");
  command->add_option("photos", options->photos, "PNG or TIFF, all of one camera at one focus")->required();
}

}  // namespace imprint
