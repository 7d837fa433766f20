#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "lib/wire/curve_packing.h"
#include "lib/wire/keys.h"
#include "lib/wire/message_bytes.h"
#include "lib/wire/wire.h"
#include "lib/wire/wire_text.h"

namespace imprint {
namespace {

constexpr std::uint32_t kSchemaVersion = 1;
constexpr std::size_t kMaxReceivedBytes = 16 * kMaxImprintBytes;  // room for fields of later versions
constexpr std::size_t kMaxFailureBytes = 240;
constexpr std::size_t kMaxWarningBytes = 120;
constexpr std::size_t kMaxWarnings = 3;
constexpr double kRotationTolerance = 1e-6;  // far above rounding, far below any real error of a pose

template <class... Values>
bool all_finite(Values... values) {
  return (std::isfinite(values) && ...);
}

bool is_rotation(const Eigen::Matrix3d& R) {
  return R.allFinite() &&
         (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRotationTolerance &&
         R.determinant() > 0.0;
}

/// Why a pose cannot be used; empty when it can. The same for sender and receiver, as are the next two.
std::string pose_fault(const CameraPose& pose) {
  if (!is_rotation(pose.R_cam_world)) return "pose: expected R_cam_world to be a rotation";
  if (!pose.center_world_mm.allFinite()) return "pose: expected a finite centre";
  if (!pose.covariance.cast<float>().allFinite()) return "pose: expected a finite covariance";
  return {};
}

std::string grid_fault(const StationGrid& grid) {
  if (!all_finite(grid.origin.x_px, grid.origin.y_px, grid.direction_x, grid.direction_y, grid.start_px, grid.step_px))
    return "grid: expected finite values";
  if (std::abs(std::hypot(grid.direction_x, grid.direction_y) - 1.0) > kRotationTolerance)
    return fmt::format("grid: expected a unit direction, found ({}, {})", grid.direction_x, grid.direction_y);
  if (grid.step_px <= 0.0) return fmt::format("grid: expected a positive step, found {} px", grid.step_px);
  return {};
}

bool has_curves(const Imprint& imprint) {
  return !(imprint.upper.offset_px.empty() && imprint.lower.offset_px.empty() && imprint.axis.offset_px.empty());
}

std::string curves_fault(const Imprint& imprint) {
  const std::size_t stations = imprint.upper.offset_px.size();
  if (stations > kImprintStations)
    return fmt::format("curves: expected at most {} stations, found {}", kImprintStations, stations);
  for (const auto* curve : {&imprint.upper, &imprint.lower, &imprint.axis})
    if (curve->offset_px.size() != stations || curve->weight.size() != stations)
      return fmt::format("curves: expected {} offsets and weights in each, found {} and {}", stations,
                         curve->offset_px.size(), curve->weight.size());
  return {};
}

std::string end_fault(const ImprintEnd& end) {
  return all_finite(end.station_px, end.offset_px, end.sigma_px) ? "" : "end: expected finite values";
}

/// Why an imprint cannot be used by any receiver; empty when it can.
std::string fault_of(const Imprint& imprint) {
  if (auto fault = pose_fault(imprint.pose); !fault.empty()) return fault;
  if (!all_finite(imprint.focal_length_px, imprint.rotation_deg))
    return "focal_length_px, rotation_deg: expected finite values";
  if (!has_curves(imprint)) return {};
  for (auto fault : {curves_fault(imprint), grid_fault(imprint.grid), end_fault(imprint.start), end_fault(imprint.end)})
    if (!fault.empty()) return fault;
  return {};
}

void fill_pose(v1::Pose& message, const CameraPose& pose) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) message.add_r_cam_world(pose.R_cam_world(row, column));
  for (int i = 0; i < 3; ++i) message.add_center_world_mm(pose.center_world_mm(i));
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      message.add_covariance(static_cast<float>(pose.covariance(row, column)));
}

void fill_grid(v1::StationGrid& message, const StationGrid& grid) {
  message.set_origin_x_px(grid.origin.x_px);
  message.set_origin_y_px(grid.origin.y_px);
  message.set_direction_x(grid.direction_x);
  message.set_direction_y(grid.direction_y);
  message.set_start_px(grid.start_px);
  message.set_step_px(grid.step_px);
}

void fill_end(v1::End& message, const ImprintEnd& end) {
  message.set_station_px(end.station_px);
  message.set_offset_px(end.offset_px);
  message.set_sigma_px(static_cast<float>(end.sigma_px));
  message.set_visible(end.visible);
}

void fill_quality(v1::FrameQuality& message, const FrameQuality& quality) {
  message.set_targets_seen(wire_count(quality.targets_seen));
  message.set_targets_used(wire_count(quality.targets_used));
  message.set_reprojection_rms_px(wire_float(quality.reprojection_rms_px));
  message.set_edge_points(wire_count(quality.edge_points));
  message.set_edge_coverage(wire_float(quality.edge_coverage));
  message.set_contrast(wire_float(quality.contrast));
  message.set_saturated_fraction(wire_float(quality.saturated_fraction));
  message.set_blur_px(wire_float(quality.blur_px));
  message.set_haze_px(wire_float(quality.haze_px));
  message.set_body_level(wire_float(quality.body_level));
  message.set_frame_saturated_fraction(wire_float(quality.frame_saturated_fraction));
}

void fill_warnings(v1::Imprint& message, const std::vector<std::string>& warnings, const CurveEconomy& economy) {
  message.clear_warnings();
  if (economy.offset_step_px > CurveEconomy{}.offset_step_px)
    message.add_warnings(fmt::format("curves too rough for {} bytes: sent in steps of {} px instead of {} px",
                                     kMaxImprintBytes, economy.offset_step_px, CurveEconomy{}.offset_step_px));
  for (std::size_t i = 0; i < std::min(warnings.size(), kMaxWarnings); ++i)
    message.add_warnings(wire_line(warnings[i], kMaxWarningBytes));
  if (warnings.size() > kMaxWarnings)
    message.add_warnings(fmt::format("and {} more, see the node's log", warnings.size() - kMaxWarnings));
}

void fill_curves(v1::Imprint& message, const Imprint& imprint) {
  fill_grid(*message.mutable_grid(), imprint.grid);
  fill_end(*message.mutable_start(), imprint.start);
  fill_end(*message.mutable_end(), imprint.end);
  // Ends: at the latest when a step is as wide as the range of all offsets, and every residual one bit.
  for (int n = 0;; ++n) {
    const CurveEconomy economy = curve_economy(n);
    *message.mutable_upper() = pack_curve(imprint.upper, economy);
    *message.mutable_lower() = pack_curve(imprint.lower, economy);
    *message.mutable_axis() = pack_curve(imprint.axis, economy);
    fill_warnings(message, imprint.warnings, economy);
    if (message.ByteSizeLong() <= kMaxImprintBytes) return;
  }
}

Result<CameraPose> read_pose(const v1::Pose& message) {
  if (message.r_cam_world_size() != 9 || message.center_world_mm_size() != 3 || message.covariance_size() != 21)
    return invalid_input("pose: expected 9 + 3 + 21 values, found {} + {} + {}", message.r_cam_world_size(),
                         message.center_world_mm_size(), message.covariance_size());
  CameraPose pose;
  for (int i = 0; i < 9; ++i) pose.R_cam_world(i / 3, i % 3) = message.r_cam_world(i);
  for (int i = 0; i < 3; ++i) pose.center_world_mm(i) = message.center_world_mm(i);
  int next = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      pose.covariance(row, column) = pose.covariance(column, row) = message.covariance(next++);
  return pose;
}

StationGrid read_grid(const v1::StationGrid& message) {
  StationGrid grid;
  grid.origin = {message.origin_x_px(), message.origin_y_px()};
  grid.direction_x = message.direction_x();
  grid.direction_y = message.direction_y();
  grid.start_px = message.start_px();
  grid.step_px = message.step_px();
  return grid;
}

ImprintEnd read_end(const v1::End& message) {
  return {message.station_px(), message.offset_px(), message.sigma_px(), message.visible()};
}

Result<FrameQuality> read_quality(const v1::FrameQuality& message) {
  FrameQuality quality;
  quality.targets_seen = read_count(message.targets_seen());
  quality.targets_used = read_count(message.targets_used());
  quality.reprojection_rms_px = message.reprojection_rms_px();
  quality.edge_points = read_count(message.edge_points());
  quality.edge_coverage = message.edge_coverage();
  quality.contrast = message.contrast();
  quality.saturated_fraction = message.saturated_fraction();
  quality.blur_px = message.blur_px();
  quality.haze_px = message.haze_px();
  quality.body_level = message.body_level();
  quality.frame_saturated_fraction = message.frame_saturated_fraction();
  if (!all_finite(quality.reprojection_rms_px, quality.edge_coverage, quality.contrast, quality.saturated_fraction,
                  quality.blur_px, quality.haze_px, quality.body_level, quality.frame_saturated_fraction))
    return invalid_input("quality: expected finite values");
  return quality;
}

Result<void> read_curves(const v1::Imprint& message, Imprint& imprint) {
  const std::pair<ImprintCurve*, const v1::Curve*> curves[] = {
      {&imprint.upper, &message.upper()}, {&imprint.lower, &message.lower()}, {&imprint.axis, &message.axis()}};
  const char* const names[] = {"upper", "lower", "axis"};
  for (int i = 0; i < 3; ++i) {
    auto curve = unpack_curve(*curves[i].second);
    if (!curve) return invalid_input("{} curve: {}", names[i], curve.error().message);
    *curves[i].first = std::move(*curve);
  }
  return {};
}

/// Reads everything; the faults of the whole are judged by the caller.
Result<Imprint> read_imprint(const v1::Imprint& message) {
  Imprint imprint;
  imprint.camera_id = message.camera_id();
  imprint.session = message.session();
  imprint.observation = message.observation();
  imprint.rotation_deg = message.rotation_deg();
  imprint.boot_id = message.boot_id();
  imprint.sequence = message.sequence();
  imprint.sensor_time_ns = message.sensor_time_ns();
  imprint.focal_length_px = message.focal_length_px();
  imprint.method = message.method();
  imprint.warnings.assign(message.warnings().begin(), message.warnings().end());
  imprint.failure = message.failure();
  imprint.pose_state = pose_state_from(static_cast<int>(message.pose_state()));
  imprint.pose_doubtful = message.pose_doubtful();
  imprint.pose_doubtful_since_ns = message.pose_doubtful_since_ns();
  if (message.has_grid()) imprint.grid = read_grid(message.grid());
  imprint.start = read_end(message.start());
  imprint.end = read_end(message.end());
  auto pose = read_pose(message.pose());
  if (!pose) return pass_on(pose.error());
  imprint.pose = *pose;
  auto quality = read_quality(message.quality());
  if (!quality) return pass_on(quality.error());
  imprint.quality = *quality;
  if (auto curves = read_curves(message, imprint); !curves) return pass_on(curves.error());
  return imprint;
}

Result<void> check_received(const Imprint& imprint) {
  if (auto checked = check_id("camera", imprint.camera_id); !checked) return checked;
  if (auto fault = fault_of(imprint); !fault.empty()) return invalid_input("{}", fault);
  if (!has_curves(imprint) && imprint.failure.empty())
    return invalid_input("expected three curves or a reason why there are none, found neither");
  return {};
}

}  // namespace

std::vector<std::uint8_t> encode_imprint(const Imprint& imprint) {
  v1::Imprint message;
  message.set_schema_version(kSchemaVersion);
  message.set_camera_id(wire_line(imprint.camera_id, kMaxIdBytes));
  message.set_session(wire_line(imprint.session, kMaxIdBytes));
  message.set_observation(imprint.observation);
  message.set_rotation_deg(finite_or_zero(imprint.rotation_deg));
  message.set_boot_id(imprint.boot_id);
  message.set_sequence(imprint.sequence);
  message.set_sensor_time_ns(imprint.sensor_time_ns);
  message.set_focal_length_px(finite_or_zero(imprint.focal_length_px));
  fill_quality(*message.mutable_quality(), imprint.quality);
  message.set_method(wire_line(imprint.method, kMaxIdBytes));
  message.set_pose_state(static_cast<v1::PoseState>(imprint.pose_state));
  message.set_pose_doubtful(imprint.pose_doubtful);
  message.set_pose_doubtful_since_ns(imprint.pose_doubtful_since_ns);

  const std::string fault = fault_of(imprint);
  const bool usable_pose = pose_fault(imprint.pose).empty();
  fill_pose(*message.mutable_pose(), usable_pose ? imprint.pose : CameraPose{});
  std::string failure = imprint.failure;
  if (failure.empty() && !has_curves(imprint)) failure = "no curves, and the node gave no reason";
  if (!fault.empty()) failure = failure.empty() ? fault : failure + "; " + fault;
  message.set_failure(wire_line(failure, kMaxFailureBytes));
  if (has_curves(imprint) && fault.empty())
    fill_curves(message, imprint);
  else
    fill_warnings(message, imprint.warnings, CurveEconomy{});
  return bytes_of(message);
}

Result<Imprint> decode_imprint(std::span<const std::uint8_t> bytes) {
  auto message = parse_message<v1::Imprint>(bytes, kMaxReceivedBytes);
  if (!message) return invalid_input("imprint: {}", message.error().message);
  auto imprint = read_imprint(*message);
  if (!imprint) return invalid_input("imprint of camera '{}': {}", message->camera_id(), imprint.error().message);
  if (auto checked = check_received(*imprint); !checked)
    return invalid_input("imprint of camera '{}': {}", message->camera_id(), checked.error().message);
  return imprint;
}

}  // namespace imprint
