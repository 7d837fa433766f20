#include "node/node_pipeline.h"

#include <cmath>

#include "node/detect/detect_config.h"
#include "node/edge/edge_config.h"
#include "node/edge/frame_measures.h"
#include "node/imprint/filter_config.h"
#include "node/imprint/trusted_rims.h"
#include "node/pose/hot_air.h"
#include "node/segment/segment_config.h"
#include "node/segment/segment_prior.h"

namespace imprint {
namespace {

using Clock = std::chrono::steady_clock;

// Runs one stage and notes how long it took.
template <class Stage>
auto timed(ProcessedFrame& frame, const char* name, Stage stage) {
  const auto start = Clock::now();
  auto result = stage();
  frame.stage_times.emplace_back(name, std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start));
  return result;
}

ProcessedFrame& give_up(ProcessedFrame& frame, Error error) {
  frame.imprint.failure = error.message;
  frame.error = std::move(error);
  return frame;
}

Result<void> check_size(const Frame& frame, const CameraModel& camera) {
  if (frame.image.cols == camera.width_px && frame.image.rows == camera.height_px) return {};
  return invalid_input("{}: is {} x {} px, but the calibration of camera \"{}\" is for {} x {} px", frame.source,
                       frame.image.cols, frame.image.rows, camera.id, camera.width_px, camera.height_px);
}

void note_resection(const Resection& resection, Imprint& imprint) {
  imprint.quality.targets_used = 0;
  imprint.quality.reprojection_rms_px = resection.reprojection_rms_px;
  for (const ResectedTarget& target : resection.targets) imprint.quality.targets_used += target.used ? 1 : 0;
  for (const int id : resection.unknown_ids) {
    imprint.warnings.push_back(fmt::format("camera \"{}\": target {} is not in the field", imprint.camera_id, id));
  }
}

// The pose that the frame is measured with: its own, or the one kept for it. Fails where there is neither.
Result<void> take_pose(const Frame& frame, bool forging_in_view, PoseKeeper* keeper, const Result<Resection>& own,
                       Imprint& imprint) {
  if (keeper == nullptr) {
    if (!own) return pass_on(own.error());
    imprint.pose = own->pose;
    return {};
  }
  const auto kept =
      keeper->update(own ? std::optional(own->pose) : std::nullopt, forging_in_view, frame.sensor_time_ns);
  if (!kept) return pass_on(own.error());
  imprint.pose = kept->pose;
  imprint.pose_state = kept->state;
  imprint.pose_doubtful = kept->doubtful;
  imprint.pose_doubtful_since_ns = kept->doubtful_since_ns;
  if (!kept->note.empty()) imprint.warnings.push_back(fmt::format("camera \"{}\": {}", imprint.camera_id, kept->note));
  if (!own) imprint.warnings.push_back(own.error().message);
  return {};
}

// A target that is smaller, or seen at less than 10 degrees to its plate, hardly helps a pose, and takes half the time
// of all to look for.
DetectConfig of_rig_targets() {
  DetectConfig config;
  config.min_dot_px = 4.0;
  config.max_axis_ratio = 6.0;
  return config;
}

// Again, with less trust in targets beside the forging; the first pose has served to find it.
Result<Resection> resect_in_hot_air(const CameraModel& camera, const Rig& rig, Result<Resection> first,
                                    const std::vector<DetectedTarget>& targets, const Segmentation& forging) {
  if (!first || rig.forging.polarity != Polarity::bright) return first;
  auto again = resect(camera, weigh_hot_air(targets, forging, HotAirConfig{}), rig.field, ResectConfig{}, rig.dots);
  return again ? std::move(again) : std::move(first);
}

// Above this share the 99.5 percentile saturates, and with it rims here and there: a clipped edge stands too far out.
constexpr double kSaturated = 0.005;

void note_measures(const FrameMeasures& measures, Imprint& imprint) {
  imprint.quality.blur_px = measures.blur_px;
  imprint.quality.haze_px = measures.haze_px;
  imprint.quality.body_level = measures.body_level;
  imprint.quality.frame_saturated_fraction = measures.frame_saturated_fraction;
}

void note_other_bodies(const Segmentation& forging, Imprint& imprint) {
  for (const SeenBody& other : forging.others) {
    imprint.warnings.push_back(fmt::format("camera \"{}\": another body at ({:.0f}, {:.0f}) px, {:.0f} x {:.0f} px: {}",
                                           imprint.camera_id, other.middle.x_px, other.middle.y_px, other.length_px,
                                           other.width_px, other.why_not));
  }
}

void note_silhouette(const Silhouette& silhouette, Imprint& imprint) {
  imprint.quality.edge_points = static_cast<int>(silhouette.upper.size() + silhouette.lower.size());
  imprint.quality.contrast = silhouette.contrast;
  imprint.quality.saturated_fraction = silhouette.saturated_fraction;
  if (silhouette.saturated_fraction > kSaturated)
    imprint.warnings.push_back(
        fmt::format("camera \"{}\": {:.1f} % of the forging is saturated, rims may stand too far out: expose less",
                    imprint.camera_id, 100.0 * silhouette.saturated_fraction));
}

void note_coverage(Imprint& imprint) {
  std::size_t trusted = 0;
  for (std::size_t i = 0; i < imprint.upper.weight.size(); ++i) {
    trusted += imprint.upper.weight[i] > 0 && imprint.lower.weight[i] > 0 ? 1 : 0;
  }
  imprint.quality.edge_coverage = static_cast<double>(trusted) / static_cast<double>(kImprintStations);
}

}  // namespace

ProcessedFrame process_frame(const Frame& frame, const CameraModel& camera, const Rig& rig, EdgeMethod method,
                             PoseKeeper* keeper) {
  ProcessedFrame result;
  Imprint& imprint = result.imprint;
  imprint.camera_id = camera.id;
  imprint.sensor_time_ns = frame.sensor_time_ns;
  imprint.focal_length_px = camera.focal_length_px;
  imprint.method = edge_method_name(method);
  if (auto size = check_size(frame, camera); !size) return give_up(result, size.error());

  result.targets = timed(result, "detect", [&] { return detect_targets(frame.image, rig.library, of_rig_targets()); });
  imprint.quality.targets_seen = static_cast<int>(result.targets.size());

  auto resection =
      timed(result, "resect", [&] { return resect(camera, result.targets, rig.field, ResectConfig{}, rig.dots); });
  const auto kept = keeper != nullptr ? keeper->kept() : std::nullopt;
  if (resection) {
    imprint.pose = resection->pose;
  } else if (kept) {
    imprint.pose = *kept;
  } else {
    return give_up(result, {resection.error().kind, fmt::format("{}: {}", frame.source, resection.error().message)});
  }

  const auto segmentation = timed(result, "segment", [&]() -> Result<Segmentation> {
    const auto prior = make_segment_prior(camera, imprint.pose, rig.forging, rig.field);
    if (!prior) return pass_on(prior.error());
    return segment_forging(frame.image, *prior, SegmentConfig{});
  });
  if (segmentation) resection = resect_in_hot_air(camera, rig, std::move(resection), result.targets, *segmentation);
  if (resection) {
    note_resection(*resection, imprint);
    result.resection = *resection;
  }
  if (auto posed = take_pose(frame, segmentation.has_value(), keeper, resection, imprint); !posed)
    return give_up(result, {posed.error().kind, fmt::format("{}: {}", frame.source, posed.error().message)});
  if (!segmentation) {
    return give_up(result, {segmentation.error().kind, fmt::format("{}: camera \"{}\": {}", frame.source, camera.id,
                                                                   segmentation.error().message)});
  }

  note_other_bodies(*segmentation, imprint);

  result.edges = timed(result, "edge", [&] {
    return locate_edges(frame.image, *segmentation, rig.forging.polarity, method, EdgeConfig{});
  });
  const Silhouette& silhouette = *result.edges;
  note_silhouette(silhouette, imprint);

  const auto filled = timed(result, "imprint", [&]() -> Result<void> {
    auto filtered = filter_silhouette(silhouette, method, FilterConfig{});
    if (!filtered) return pass_on(filtered.error());
    result.silhouette = std::move(*filtered);
    return fill_curves(*result.silhouette, camera, imprint);
  });
  note_measures(timed(result, "measure",
                      [&] {
                        const Silhouette rims =
                            result.silhouette ? trusted_rims(silhouette, *result.silhouette) : silhouette;
                        return measure_frame(frame.image, rims, rig.forging.polarity);
                      }),
                imprint);
  if (!filled) {
    return give_up(result, {filled.error().kind,
                            fmt::format("{}: camera \"{}\": {}", frame.source, camera.id, filled.error().message)});
  }
  note_coverage(imprint);
  return result;
}

}  // namespace imprint
