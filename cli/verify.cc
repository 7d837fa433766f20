#include <filesystem>
#include <set>

#include <fmt/core.h>

#include "cli/command.h"
#include "cli/verify_chart.h"
#include "lib/clock/wall_clock.h"
#include "lib/config/atomic_file.h"
#include "lib/rig/rig.h"
#include "node/capture/image_file.h"
#include "node/detect/detect_config.h"
#include "survey/verify.h"
#include "survey/verify_history.h"

namespace imprint {
namespace {

namespace fs = std::filesystem;

struct VerifyOptions {
  fs::path rig, bars, targets, history, chart;
  double limit_mm = 0.0;
  std::vector<std::string> views;  // CAMERA=FILE
};

// What `imprint targets detect --json` wrote of one image.
Result<std::vector<DetectedTarget>> read_detections(const fs::path& path, const CameraModel& camera) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  const auto document = nlohmann::json::parse(*text, nullptr, false);
  const auto wrong = [&](std::string_view what) {
    return invalid_input("{}: expected what `imprint targets detect --json` writes of one image: {}", path.string(),
                         what);
  };
  if (!document.is_object() || !document.contains("images") || !document["images"].is_array() ||
      document["images"].size() != 1 || !document["images"][0].is_object())
    return wrong("images with one entry");
  const auto& image = document["images"][0];
  const auto number = [](const nlohmann::json& object, const char* key, double fallback) {
    return object.contains(key) && object[key].is_number() ? object[key].get<double>() : fallback;
  };
  if (number(image, "width_px", 0.0) != camera.width_px || number(image, "height_px", 0.0) != camera.height_px)
    return wrong(
        fmt::format("width_px {} and height_px {} of camera \"{}\"", camera.width_px, camera.height_px, camera.id));
  if (!image.contains("targets") || !image["targets"].is_array()) return wrong("targets, a list");
  std::vector<DetectedTarget> targets;
  for (const auto& entry : image["targets"]) {
    const bool valid = entry.is_object() && entry.contains("id") && entry["id"].is_number_integer() &&
                       entry.contains("x_px") && entry["x_px"].is_number() && entry.contains("y_px") &&
                       entry["y_px"].is_number();
    if (!valid) return wrong("id, x_px and y_px of each target");
    DetectedTarget target;
    target.id = entry["id"].get<int>();
    target.center = {entry["x_px"].get<double>(), entry["y_px"].get<double>()};
    target.sigma_px = number(entry, "sigma_px", 0.0);
    target.dot_diameter_px = number(entry, "dot_diameter_px", 0.0);
    targets.push_back(target);
  }
  return targets;
}

Result<std::vector<DetectedTarget>> see(const fs::path& path, const CameraModel& camera, const TargetLibrary& library) {
  if (path.extension() == ".json") return read_detections(path, camera);
  std::vector<std::string> warnings;
  const auto frame = read_image(path, &warnings);
  if (!frame) return pass_on(frame.error());
  for (const std::string& warning : warnings) std::cerr << "imprint: warning: " << warning << '\n';
  if (frame->image.cols != camera.width_px || frame->image.rows != camera.height_px)
    return invalid_input("{}: is {} x {} px, but camera \"{}\" is calibrated for {} x {}", path.string(),
                         frame->image.cols, frame->image.rows, camera.id, camera.width_px, camera.height_px);
  return detect_targets(frame->image, library, DetectConfig{});
}

Result<std::vector<VerifyView>> load_views(const VerifyOptions& options, const Rig& rig) {
  std::vector<VerifyView> views;
  std::set<std::string> seen;
  for (const std::string& text : options.views) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
      return invalid_input("{}: expected CAMERA=IMAGE, such as cam1=cam1.png", text);
    const std::string id = text.substr(0, equals);
    const CameraModel* camera = rig.find_camera(id);
    if (camera == nullptr) return invalid_input("{}: {} has no camera \"{}\"", text, options.rig.string(), id);
    if (!seen.insert(id).second) return invalid_input("{}: camera \"{}\" stands there twice", text, id);
    auto targets = see(text.substr(equals + 1), *camera, rig.library);
    if (!targets) return pass_on(targets.error());
    views.push_back({*camera, std::move(*targets)});
  }
  return views;
}

Result<VerifyReport> verify(const VerifyOptions& options) {
  VerifyChecks checks;
  if (!options.bars.empty()) {
    auto bars = read_scale_bars(options.bars);
    if (!bars) return pass_on(bars.error());
    checks.bars = std::move(*bars);
  }
  if (!options.targets.empty()) {
    auto targets = read_target_field(options.targets);
    if (!targets) return pass_on(targets.error());
    checks.targets = std::move(*targets);
  }
  const auto rig = read_rig(options.rig);
  if (!rig) return pass_on(rig.error());
  const auto views = load_views(options, *rig);
  if (!views) return pass_on(views.error());
  return verify_rig(*views, rig->field, checks);
}

bool passes(const Verification& check, double limit_mm) { return std::abs(check.deviation_mm) <= limit_mm; }

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text.append(text.empty() ? "" : " ").append(name);
  return text;
}

Result<void> keep(const VerifyOptions& options, const VerifyReport& report) {
  const std::string now = utc_text(wall_clock_ns());
  std::vector<HistoryRow> rows;
  for (const Verification& check : report.checks)
    rows.push_back({now, check.what, check.nominal_mm, check.measured_mm, check.deviation_mm, check.ci95_mm,
                    options.limit_mm, joined(check.cameras), passes(check, options.limit_mm)});
  return append_history(options.history, rows);
}

Result<void> draw_chart(const VerifyOptions& options) {
  const bool page = options.chart.extension() == ".html";
  if (!page && options.chart.extension() != ".svg")
    return invalid_input("--chart {}: expected a name that ends in .svg or .html", options.chart.string());
  const auto rows = read_history(options.history);
  if (!rows) return pass_on(rows.error());
  if (rows->empty()) return job_failed("{}: holds no verification yet", options.history.string());
  return write_file_atomically(options.chart, draw_history(*rows, page));
}

nlohmann::json describe(const VerifyReport& report, double limit_mm, bool pass) {
  nlohmann::json json{{"pass", pass}, {"limit_mm", limit_mm}, {"checks", nlohmann::json::array()}};
  for (const Verification& check : report.checks)
    json["checks"].push_back({{"what", check.what},
                              {"nominal_mm", check.nominal_mm},
                              {"measured_mm", check.measured_mm},
                              {"deviation_mm", check.deviation_mm},
                              {"ci95_mm", check.ci95_mm},
                              {"cameras", check.cameras},
                              {"pass", passes(check, limit_mm)}});
  json["warnings"] = report.warnings;
  return json;
}

// Options that make no sense together, before anything is read.
Result<void> check_options(const VerifyOptions& options) {
  if (options.views.empty() && options.rig.empty()) {
    if (options.chart.empty() || options.history.empty())
      return invalid_input("expected --rig and CAMERA=IMAGE... to verify, or --history and --chart to draw");
    return {};
  }
  if (options.rig.empty()) return invalid_input("--rig: missing, expected rig.toml");
  if (options.views.size() < 2)
    return invalid_input("expected CAMERA=IMAGE of at least 2 cameras, found {}", options.views.size());
  if (options.bars.empty() && options.targets.empty())
    return invalid_input("expected --scale-bars or --check-targets, or both");
  if (!(options.limit_mm > 0.0))
    return invalid_input("--limit-mm: expected the largest deviation that passes, above 0, found {}", options.limit_mm);
  if (!options.chart.empty() && options.history.empty()) return invalid_input("--chart: needs --history");
  return {};
}

int run_verify(const VerifyOptions& options, bool as_json) {
  if (auto valid = check_options(options); !valid) return fail(valid.error());
  bool pass = true;
  if (!options.views.empty()) {
    const auto report = verify(options);
    if (!report) return fail(report.error());
    for (const std::string& warning : report->warnings) std::cerr << "imprint: warning: " << warning << '\n';
    for (const Verification& check : report->checks) {
      pass = pass && passes(check, options.limit_mm);
      if (check.ci95_mm > options.limit_mm)
        std::cerr << fmt::format(
            "imprint: warning: {}: its 95 % interval of {:.3f} mm is wider than the limit: it cannot tell\n",
            check.what, check.ci95_mm);
    }
    if (!options.history.empty()) {
      if (auto kept = keep(options, *report); !kept) return fail(kept.error());
    }
    if (as_json) {
      print_json(describe(*report, options.limit_mm, pass));
    } else {
      for (const Verification& check : report->checks)
        fmt::print("{}: {}: {:.4f} mm, deviation {:+.4f} mm (+-{:.4f}, 95 %), limit {:.4f} mm\n",
                   passes(check, options.limit_mm) ? "pass" : "FAIL", check.what, check.measured_mm, check.deviation_mm,
                   check.ci95_mm, options.limit_mm);
    }
  }
  if (!options.chart.empty()) {
    if (auto drawn = draw_chart(options); !drawn) return fail(drawn.error());
  }
  return pass ? 0 : 1;
}

}  // namespace

void add_verify_command(Cli& cli) {
  auto options = std::make_shared<VerifyOptions>();
  auto* command =
      cli.command(cli.app, "verify", "measures a scale bar or check targets with the rig: pass (0) or fail (1)",
                  [options, &cli] { return run_verify(*options, cli.json); });
  command->add_option("--rig", options->rig, "rig.toml");
  command->add_option("--scale-bars", options->bars, "bars.csv: id_a,id_b,length_mm,sigma_mm");
  command->add_option("--check-targets", options->targets, "like field.csv: targets whose places are known");
  command->add_option("--limit-mm", options->limit_mm, "largest deviation that passes");
  command->add_option("--history", options->history, "CSV to which each verification is added");
  command->add_option("--chart", options->chart, "draw the history: .svg or .html; without images, that alone");
  command->add_option("views", options->views, "CAMERA=IMAGE, taken at the same time (or targets detect's JSON)");
}

}  // namespace imprint
