#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "lib/camera/camera_model.h"
#include "lib/camera/dot_disc.h"
#include "lib/result/result.h"
#include "lib/targets/target_field.h"
#include "survey/bundle.h"
#include "survey/datum.h"
#include "survey/first_network.h"
#include "survey/network.h"
#include "survey/scale_bar.h"

namespace imprint {

struct SurveyConfig {
  double noise_floor_px = 0.01;     ///< added to each centre's sigma: what a detector does not know of itself (ours)
  double reject_sigmas = 4.5;       ///< a sight is left out beyond this many robust standard deviations (ours)
  double reject_floor_px = 0.1;     ///< and no nearer than this (ours)
  int min_rays = 3;                 ///< below, a target is reported: two rays cannot contradict each other (ours)
  double min_angle_deg = 25.0;      ///< of the widest pair of rays, below which a target is reported; [B] table 1
  double max_sigma_ratio = 2.0;     ///< of a target's sigma to the median, above which it is reported (ours)
  double bar_sigmas = 4.0;          ///< by which scale bars may disagree (ours)
  double max_focal_spread = 0.004;  ///< of one photograph's focal length from the others': one camera, one focus (ours)
  double max_focal_difference = 0.25;  ///< of the focal length found from the one stated (ours)
  bool correct_eccentricity = true;    ///< of the dots' images, from their sizes
  FirstNetworkConfig start;

  [[nodiscard]] Result<void> validate() const;
};

struct SurveyInput {
  CameraModel camera;              ///< image size; focal length where known, else 0
  bool camera_calibrated = false;  ///< its constants are better start values than none
  std::vector<SurveyPhoto> photos;
  std::vector<ScaleBar> bars;
  DatumChoice datum;
};

struct SurveyTarget {
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< mm^2, of the free network with the scale bars
  int rays = 0;                                          ///< that fit
  double angle_deg = 0.0;                                ///< widest between two of them
  std::string needs;                                     ///< why it needs more photographs; empty: it does not

  /// Root mean square over the three coordinates: what `field.csv` states.
  [[nodiscard]] double sigma_mm() const;
};

struct SurveyBar {
  ScaleBar bar;
  double measured_mm = 0.0;        ///< in the final network
  double measured_sigma_mm = 0.0;  ///< of the photographs alone, the scale aside
  bool seen = false;
};

struct RejectedSight {
  std::size_t photo = 0;
  int id = 0;
  double off_px = 0.0;
};

struct Survey {
  CameraModel camera;
  InteriorMatrix interior_covariance = InteriorMatrix::Zero();
  std::map<int, SurveyTarget> targets;
  DotDiscs dots;  ///< of the targets that four or more photographs show; in the frame of `targets`
  std::vector<SurveyBar> bars;
  std::vector<std::optional<CameraPose>> poses;  ///< by photograph; none where it could not be used
  std::vector<Sight> sights;
  std::vector<RejectedSight> rejected;
  std::vector<int> seen_once;  ///< ids that one photograph shows only, or from one place only
  Datum datum;
  int observations = 0;              ///< sights used
  double reprojection_rms_px = 0.0;  ///< root mean square of the residual's length over them
  double sigma_scale = 1.0;          ///< how much larger the residuals are than the centres' sigmas
  std::vector<std::string> warnings;

  [[nodiscard]] TargetField field() const;
};

/// Measures the targets' places from photographs of one camera at one focus, [B] 2.2 and 3.1 (there by a bought
/// system): start values from the sights alone, free-network bundle adjustment with the camera's constants unknown,
/// scale from the bars. Covariances are those of the adjustment, scaled by the residuals found.
/// Fails (job_failed, invalid_input) with what does not hang together: photographs, targets, bars, cameras.
Result<Survey> survey_field(const SurveyInput& input, const SurveyConfig& config);

}  // namespace imprint
