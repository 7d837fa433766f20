#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lib/camera/camera_pose.h"
#include "lib/geometry/points.h"
#include "lib/imprint/pose_state.h"

namespace imprint {

/// One curve of an imprint, sampled at the imprint's stations.
struct ImprintCurve {
  std::vector<double> offset_px;  ///< along the grid's normal, one a station
  std::vector<double> weight;     ///< 0 (not to be trusted, or nothing there) to 1, one a station
};

/// The straight line in the ideal image along which the curves are sampled:
/// station i stands at origin + (start_px + i step_px) direction; curves deviate along the normal,
/// which is the direction turned by +90 deg from x to y (for direction (1, 0): (0, 1), down).
struct StationGrid {
  IdealPoint origin;
  double direction_x = 1.0;  ///< unit vector, x component
  double direction_y = 0.0;
  double start_px = 0.0;
  double step_px = 1.0;

  [[nodiscard]] IdealPoint at(double station_px, double offset_px) const {
    return {origin.x_px + station_px * direction_x - offset_px * direction_y,
            origin.y_px + station_px * direction_y + offset_px * direction_x};
  }
  [[nodiscard]] double station_px(std::size_t i) const { return start_px + step_px * static_cast<double>(i); }
};

/// One end of the forging as the silhouette shows it: the outermost point of the outline near the axis.
struct ImprintEnd {
  double station_px = 0.0;  ///< along the grid's line, same origin as the stations
  double offset_px = 0.0;   ///< where across it was read (near the axis)
  double sigma_px = 0.0;
  bool visible = false;  ///< false: out of view, covered or not found
};

/// What was seen of the frame, for the operator and for health.
struct FrameQuality {
  int targets_seen = 0;
  int targets_used = 0;
  double reprojection_rms_px = 0.0;
  int edge_points = 0;                    ///< edge points found before filtering, both rims
  double edge_coverage = 0.0;             ///< share of the stations with both rims trusted, 0 to 1
  double contrast = 0.0;                  ///< median step across the rims, share of full scale
  double saturated_fraction = 0.0;        ///< share of saturated pixels inside the forging
  double frame_saturated_fraction = 0.0;  ///< and in the whole frame, lamps and all
  double body_level = 0.0;  ///< 99.5 percentile of the forging (dark: of its surroundings), share of full scale
  double blur_px = 0.0;     ///< standard deviation of the blur across the rims, pixel area left out; 0: unknown
  double haze_px = 0.0;     ///< edge jitter beyond the noise: hot air, RMS along a fifth of the diameter
};

/// Number of stations of a curve, [D] 2.1.2.
inline constexpr std::size_t kImprintStations = 500;

/// What one camera saw of the forging in one frame, distortion removed: the message of `cam/<id>/imprint`.
struct Imprint {
  std::string camera_id;
  std::string session;
  std::uint32_t observation = 0;
  double rotation_deg = 0.0;
  std::uint64_t boot_id = 0;        ///< changes with every start of the node
  std::uint64_t sequence = 0;       ///< counts the node's imprints from 1
  std::int64_t sensor_time_ns = 0;  ///< since the Unix epoch
  double focal_length_px = 0.0;
  CameraPose pose;
  PoseState pose_state = PoseState::tracking;
  bool pose_doubtful = false;  ///< the camera has moved, or its targets could not confirm the kept pose
  /// Where not 0: the camera was last known to stand still then; what it saw later, to this frame, is doubtful too.
  std::int64_t pose_doubtful_since_ns = 0;
  StationGrid grid;
  ImprintCurve upper;  ///< smaller offset
  ImprintCurve lower;  ///< larger offset
  ImprintCurve axis;   ///< middle of the two, filtered on its own
  ImprintEnd start;    ///< end with the smaller station
  ImprintEnd end;
  FrameQuality quality;
  std::string method;  ///< the edge method used, contract section 3
  std::vector<std::string> warnings;
  std::string failure;  ///< why there are no curves; empty when there are
};

}  // namespace imprint
