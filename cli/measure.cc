#include <algorithm>
#include <charconv>
#include <filesystem>

#include <fmt/core.h>

#include "cli/acceptance_table.h"
#include "cli/command.h"
#include "cli/hot_options.h"
#include "cli/result_table.h"
#include "fusion/acceptance/acceptance.h"
#include "fusion/fusion_pipeline.h"
#include "lib/clock/wall_clock.h"
#include "lib/config/atomic_file.h"
#include "lib/rig/session_file.h"
#include "lib/wire/wire.h"
#include "node/capture/image_file.h"
#include "node/node_pipeline.h"

namespace imprint {
namespace {

struct MeasureOptions {
  std::filesystem::path session;
  std::filesystem::path out;
  std::string method = "best";
  std::string geometry = "joint";
  std::vector<std::string> stations;  // NAME=MM
  HotOptions hot;
  std::filesystem::path nominal;
};

// The imprint with its curves rounded as the wire rounds them, so that a running line gives the same numbers; where
// the data are poor a thousandth of a pixel can decide. Texts, which the wire shortens, stay as they are.
Imprint as_sent(const Imprint& imprint) {
  Imprint addressed = imprint;
  addressed.session = "measure";
  auto sent = decode_imprint(encode_imprint(addressed));
  if (!sent) return imprint;  // an id that no key can carry; it has no running line to be compared with
  sent->session = imprint.session;
  sent->warnings = imprint.warnings;
  if (!imprint.failure.empty()) sent->failure = imprint.failure;
  return std::move(*sent);
}

// One picture through the node's stages. A picture that cannot be read, or of the wrong size, ends the
// measurement; one in which nothing can be found only loses its camera.
Result<Imprint> imprint_of(const std::filesystem::path& file, const CameraModel& camera, const Rig& rig,
                           EdgeMethod method) {
  std::vector<std::string> warnings;
  const auto frame = read_image(file, &warnings);
  if (!frame) return pass_on(frame.error());
  ProcessedFrame processed = process_frame(*frame, camera, rig, method);
  if (processed.error && processed.error->kind == ErrorKind::invalid_input) return pass_on(*processed.error);
  processed.imprint.warnings.insert(processed.imprint.warnings.begin(), warnings.begin(), warnings.end());
  return as_sent(processed.imprint);
}

Result<Observation> observe(const SessionObservation& files, int index, const std::filesystem::path& session,
                            const Rig& rig, EdgeMethod method) {
  Observation observation{index, files.rotation_deg, {}, {}};
  for (const auto& [id, file] : files.images) {
    if (rig.find_camera(id) == nullptr) {
      return invalid_input("{}: observation {}: camera \"{}\" is not in the rig", session.string(), index, id);
    }
  }
  for (const CameraModel& camera : rig.cameras) {
    const auto file = files.images.find(camera.id);
    if (file == files.images.end()) {
      observation.missing.emplace_back(camera.id, "the session names no image of it");
      continue;
    }
    auto imprint = imprint_of(file->second, camera, rig, method);
    if (!imprint) return pass_on(imprint.error());
    imprint->observation = static_cast<std::uint32_t>(index);
    imprint->rotation_deg = files.rotation_deg;
    observation.imprints.push_back(std::move(*imprint));
  }
  return observation;
}

Result<std::vector<Measurement::Station>> read_stations(const std::vector<std::string>& texts) {
  std::vector<Measurement::Station> stations;
  for (const std::string& text : texts) {
    const auto equals = text.rfind('=');
    double s_mm = 0.0;
    const char* last = text.data() + text.size();
    const char* number = equals == std::string::npos ? last : text.data() + equals + 1;
    const auto parsed = std::from_chars(number, last, s_mm);
    if (equals == std::string::npos || equals == 0 || parsed.ec != std::errc() || parsed.ptr != last || !(s_mm >= 0.0))
      return invalid_input("--station: NAME=MM with MM from the first end expected, found \"{}\"", text);
    stations.push_back({text.substr(0, equals), s_mm});
  }
  return stations;
}

Result<Measurement> measure(const MeasureOptions& options) {
  auto stations = read_stations(options.stations);
  if (!stations) return pass_on(stations.error());
  const auto method = edge_method_from_name(options.method);
  if (!method) return pass_on(method.error());
  auto cooling = cooling_from(options.hot);
  if (!cooling) return pass_on(cooling.error());
  std::vector<std::string> warnings;
  const auto session = read_session_file(options.session, warnings);
  if (!session) return pass_on(session.error());
  const auto rig = read_rig(session->rig);
  if (!rig) return pass_on(rig.error());
  std::vector<Observation> observations;
  for (const SessionObservation& files : session->observations) {
    auto observation = observe(files, static_cast<int>(observations.size()), options.session, *rig, *method);
    if (!observation) return pass_on(observation.error());
    observations.push_back(std::move(*observation));
  }
  auto measurement = fuse(observations, rig->forging, options.session.stem().string(), options.method,
                          geometry_method_of(options.geometry));
  if (!measurement) return measurement;
  measurement->warnings.insert(measurement->warnings.begin(), rig->warnings.begin(), rig->warnings.end());
  measurement->warnings.insert(measurement->warnings.begin(), warnings.begin(), warnings.end());
  measurement->cooling = std::move(*cooling);
  measurement->stations = std::move(*stations);
  for (const Measurement::Station& station : measurement->stations)
    if (station.s_mm > measurement->length_mm)
      measurement->warnings.push_back(fmt::format("station {} at {:.1f} mm lies beyond the forging's {:.1f} mm",
                                                  station.name, station.s_mm, measurement->length_mm));
  measurement->made_at = utc_text(wall_clock_ns());
  return measurement;
}

int run_measure(const MeasureOptions& options, bool json) {
  std::optional<Nominal> nominal;
  if (!options.nominal.empty()) {
    auto read = read_nominal(options.nominal);
    if (!read) return fail(read.error());
    nominal = std::move(*read);
  }
  const auto measurement = measure(options);
  if (!measurement) return fail(measurement.error());
  for (const std::string& warning : measurement->warnings) std::cerr << "imprint: warning: " << warning << '\n';
  auto document = to_json(*measurement);
  if (nominal) {
    const auto acceptance = accept(*measurement, *nominal);
    if (!acceptance) return fail(acceptance.error());
    document["nominal"] = to_json(*acceptance);
  }
  if (!options.out.empty()) {
    if (auto written = write_file_atomically(options.out, document.dump(1) + "\n"); !written)
      return fail(written.error());
  }
  if (json) return print_json(document);
  std::cout << result_table(*measurement);
  for (const std::string& line : acceptance_lines(document)) std::cout << "  " << line << '\n';
  return 0;
}

}  // namespace

void add_measure_command(Cli& cli) {
  auto options = std::make_shared<MeasureOptions>();
  auto* command = cli.command(cli.app, "measure", "the whole measurement, from the images of a session to the geometry",
                              [options, &cli] { return run_measure(*options, cli.json); });
  command->add_option("session", options->session, "session.toml")->required();
  command->add_option("--method", options->method, "best, orientation, magnitude, combined, uniform, none or pixel")
      ->capture_default_str();
  command
      ->add_option("--geometry", options->geometry,
                   "joint: from all tangents at once; thesis: axis as the middle of the rims")
      ->check(CLI::IsMember(std::vector<std::string>(kGeometryMethods.begin(), kGeometryMethods.end())))
      ->capture_default_str();
  command->add_option("--station", options->stations,
                      "NAME=MM: name a place whose diameter is reported; may be repeated");
  add_hot_options(*command, options->hot);
  command->add_option("--nominal", options->nominal,
                      "what is wanted (TOML or CSV): tolerances, allowance, finished part");
  command->add_option("--out", options->out, "write result.json here");
}

}  // namespace imprint
