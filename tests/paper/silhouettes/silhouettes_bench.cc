// Rims, axes and ends of rendered frames against their exact images, all edge methods of [C] and ours:
// silhouettes_bench SESSION_FOLDER... prints one JSON document. Run by `./dev bench silhouettes`.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include <fmt/core.h>

#include "lib/rig/session_file.h"
#include "node/capture/image_file.h"
#include "node/edge/edge_config.h"
#include "node/imprint/filter_config.h"
#include "node/imprint/make_imprint.h"
#include "node/segment/segment_config.h"
#include "node/segment/segment_prior.h"
#include "tests/paper/silhouettes/image_truth.h"

namespace {

using namespace imprint;
using namespace imprint::bench;

constexpr std::array<EdgeMethod, 7> methods{EdgeMethod::pixel,       EdgeMethod::none,     EdgeMethod::uniform,
                                            EdgeMethod::orientation, EdgeMethod::combined, EdgeMethod::magnitude,
                                            EdgeMethod::best};
constexpr double near_end_px = 4.0;  // the rims' ends themselves belong to the ends

/// Errors in px of one quantity at all stations of all frames.
struct Errors {
  std::vector<double> values;
  std::size_t stations = 0;  // at which there is something to be found

  [[nodiscard]] nlohmann::json summary() const {
    if (values.empty()) return {{"share", 0.0}};
    double sum = 0, squares = 0;
    std::vector<double> sizes;
    for (const double e : values) sum += e, squares += e * e, sizes.push_back(std::abs(e));
    std::sort(sizes.begin(), sizes.end());
    const auto count = static_cast<double>(values.size());
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    return {{"max", sizes.back()},
            {"range", *high - *low},
            {"median", sizes[sizes.size() / 2]},
            {"mean", sum / count},
            {"sigma", std::sqrt(squares / count)},  // about the truth, not about the mean
            {"p99", sizes[sizes.size() * 99 / 100]},
            {"share", count / static_cast<double>(stations)}};
  }
};

struct MethodErrors {
  Errors axis, diameter, rim;
};

struct EndErrors {
  int visible = 0;
  std::vector<double> errors, normalized;

  void add(const LocatedEnd& found, double station_px) {
    ++visible;
    if (!found.visible) return;
    errors.push_back(found.station_px - station_px);
    normalized.push_back(errors.back() / found.sigma_px);
  }
  [[nodiscard]] nlohmann::json summary() const {
    double squares = 0, normalized_squares = 0, largest = 0;
    int within = 0;
    for (const double e : errors)
      squares += e * e, largest = std::max(largest, std::abs(e)), within += std::abs(e) <= 0.3;
    for (const double e : normalized) normalized_squares += e * e;
    const double count = std::max<double>(1.0, static_cast<double>(errors.size()));
    return {{"visible", visible}, {"found", errors.size()},
            {"within", within},   {"rms", std::sqrt(squares / count)},
            {"max", largest},     {"normalized_rms", std::sqrt(normalized_squares / count)}};
  }
};

struct Totals {
  int frames = 0, failed = 0;
  std::vector<std::string> failures;
  std::array<MethodErrors, methods.size()> by_method;
  EndErrors ends;
};

void add_curve(const std::vector<FilteredPoint>& curve, double first, double last, const auto& truth, Errors& errors) {
  errors.stations += static_cast<std::size_t>(std::max(0.0, last - first));
  for (const FilteredPoint& p : curve) {
    if (!(p.weight > 0) || p.station_px < first || p.station_px > last) continue;
    if (const double expected = truth(p.station_px); !std::isnan(expected))
      errors.values.push_back(p.offset_px - expected);
  }
}

void add_diameters(const FilteredSilhouette& found, double first, double last, const TrueRim& upper,
                   const TrueRim& lower, Errors& errors) {
  errors.stations += static_cast<std::size_t>(std::max(0.0, last - first));
  auto u = found.upper.begin();
  for (const FilteredPoint& l : found.lower) {
    while (u != found.upper.end() && u->station_px < l.station_px - 1e-6) ++u;
    if (u == found.upper.end() || u->station_px > l.station_px + 1e-6) continue;
    if (!(u->weight > 0 && l.weight > 0) || l.station_px < first || l.station_px > last) continue;
    errors.values.push_back(l.offset_px - u->offset_px - lower.offset_px(l.station_px) + upper.offset_px(l.station_px));
  }
}

void add_frame(const cv::Mat& image, const Segmentation& segmentation, Polarity polarity, const ImageTruth& truth,
               const std::string& name, Totals& totals) {
  const SilhouetteFrame frame(segmentation);
  const bool turned = frame.station_px(truth.start) > frame.station_px(truth.end);
  const TrueRim one(truth.upper, frame), other(truth.lower, frame);
  const bool swapped = one.offset_px(0.5 * (one.first_station_px() + one.last_station_px())) >
                       other.offset_px(0.5 * (other.first_station_px() + other.last_station_px()));
  const TrueRim &upper = swapped ? other : one, &lower = swapped ? one : other;
  const double first = std::max(upper.first_station_px(), lower.first_station_px()) + near_end_px;
  const double last = std::min(upper.last_station_px(), lower.last_station_px()) - near_end_px;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const auto silhouette = locate_edges(image, segmentation, polarity, methods[m], EdgeConfig{});
    const auto found = filter_silhouette(silhouette, methods[m], FilterConfig{});
    if (!found) {
      totals.failures.push_back(fmt::format("{}: {}: {}", name, edge_method_name(methods[m]), found.error().message));
      continue;
    }
    MethodErrors& errors = totals.by_method[m];
    add_curve(
        found->upper, first, last, [&](double s) { return upper.offset_px(s); }, errors.rim);
    add_curve(
        found->lower, first, last, [&](double s) { return lower.offset_px(s); }, errors.rim);
    add_curve(
        found->axis, first, last, [&](double s) { return 0.5 * (upper.offset_px(s) + lower.offset_px(s)); },
        errors.axis);
    add_diameters(*found, first, last, upper, lower, errors.diameter);
    if (methods[m] != EdgeMethod::best) continue;
    totals.ends.add(found->start, frame.station_px(turned ? truth.end : truth.start));
    totals.ends.add(found->end, frame.station_px(turned ? truth.start : truth.end));
  }
}

// Throws what the readers say; a bench has no use for a session that cannot be read.
template <class T>
T or_throw(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

void add_session(const std::filesystem::path& folder, Totals& totals) {
  const SessionFile session = or_throw(read_session_file(folder / "session.toml"));
  const Rig rig = or_throw(read_rig(session.rig));
  std::ifstream file(folder / "truth.json");
  const auto truth = nlohmann::json::parse(file);
  for (std::size_t i = 0; i < session.observations.size(); ++i) {
    for (const auto& [id, path] : session.observations[i].images) {
      const Frame frame = or_throw(read_image(path, nullptr));
      const ImageTruth exact = image_truth(truth, static_cast<int>(i), id);
      const auto prior = or_throw(make_segment_prior(*rig.find_camera(id), exact.pose, rig.forging, rig.field));
      const auto segmentation = segment_forging(frame.image, prior, SegmentConfig{});
      const std::string name = folder.filename() / path.filename();
      ++totals.frames;
      if (segmentation) {
        add_frame(frame.image, *segmentation, rig.forging.polarity, exact, name, totals);
      } else {
        ++totals.failed;
        totals.failures.push_back(fmt::format("{}: {}", name, segmentation.error().message));
      }
    }
  }
}

nlohmann::json report(const Totals& totals) {
  nlohmann::json json{{"frames", totals.frames},
                      {"failed", totals.failed},
                      {"failures", totals.failures},
                      {"ends", totals.ends.summary()}};
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const MethodErrors& errors = totals.by_method[m];
    json["methods"][std::string(edge_method_name(methods[m]))] = {
        {"axis", errors.axis.summary()}, {"diameter", errors.diameter.summary()}, {"rim", errors.rim.summary()}};
  }
  return json;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Totals totals;
    for (int i = 1; i < argc; ++i) add_session(argv[i], totals);
    fmt::print("{}\n", report(totals).dump());
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "silhouettes_bench: {}\n", error.what());
    return 2;
  }
}
