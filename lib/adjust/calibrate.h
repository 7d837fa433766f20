#pragma once

#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/camera/dot_disc.h"
#include "lib/result/result.h"
#include "lib/targets/target_field.h"

namespace imprint {

/// The constants of a camera that a calibration finds, in the order of its covariance.
inline constexpr std::array<std::string_view, 10> kInteriorNames{
    "focal_length_px", "principal_point_x_px", "principal_point_y_px", "A1", "A2", "A3", "B1", "B2", "C1", "C2"};
inline constexpr int kInteriorTerms = static_cast<int>(kInteriorNames.size());
using InteriorMatrix = Eigen::Matrix<double, kInteriorTerms, kInteriorTerms>;

struct CalibrateConfig {
  double noise_floor_px = 0.01;     ///< added to each centre's sigma: what a detector does not know of itself (ours)
  double reject_sigmas = 4.5;       ///< a target is left out beyond this many robust standard deviations (ours)
  double reject_floor_px = 0.1;     ///< and no nearer than this: of exact centres nothing is to be left out (ours)
  int min_targets = 6;              ///< of one image (ours)
  double max_rejected_share = 0.5;  ///< of an image's targets, above which the image belongs to something else (ours)
  double max_focal_difference = 0.25;  ///< of the focal length found from the one stated (ours)
  double mixed_focal_sigmas = 6.0;     ///< an image's own focal length this far from the others': other camera (ours)
  double mixed_focal_share = 0.002;    ///< and by no less than this share: a lens breathes with warmth (ours)
  double warn_correlation = 0.98;      ///< between constants, above which the images do not separate them (ours)
  double warn_focal_share = 1e-3;      ///< 95 % half-width of the focal length worth a warning; [B] table 3: 6e-5
  double warn_principal_point_share = 0.005;  ///< of half the image's shorter side; [B] table 3: 6e-4
  double min_turn_deg = 20.0;  ///< of roll or viewing direction between images, for them to differ (ours)
  double flat_share = 0.02;    ///< thickness over extent below which a field is flat (ours)

  [[nodiscard]] Result<void> validate() const;
};

/// A coded target's centre in one image.
struct PointObservation {
  int id = 0;
  ObservedPoint at;
  double sigma_px = 0.0;
};

struct CalibrationImage {
  std::string name;  ///< for messages
  CameraPose start;
  std::vector<PointObservation> points;
};

struct CalibrationResidual {
  std::size_t image = 0;
  int id = 0;
  ObservedPoint at;
  double dx_px = 0.0;  ///< observed minus projected
  double dy_px = 0.0;
  bool used = false;
};

struct UnknownTarget {
  std::size_t image = 0;
  int id = 0;
};

struct Calibration {
  CameraModel camera;
  InteriorMatrix covariance = InteriorMatrix::Zero();  ///< of kInteriorNames, with the variances the residuals show
  std::vector<CameraPose> poses;                       ///< one an image
  std::vector<CalibrationResidual> residuals;          ///< of every target that the field knows
  std::vector<UnknownTarget> unknown;                  ///< seen, but not in the field
  double reprojection_rms_px = 0.0;                    ///< root mean square of the residual's length, used targets
  double target_sigma_mm = 0.0;  ///< found: of each coordinate of a target, beyond the sigma that the field states
  int observations = 0;          ///< used targets over all images
  std::vector<std::string> warnings;

  [[nodiscard]] double ci95(int term) const { return 1.96 * std::sqrt(std::max(0.0, covariance(term, term))); }
};

/// Interior orientation from several images of a known field at once, [B] 2.3 equations 1 to 5: least squares on the
/// reprojection error over the camera's ten constants, one pose an image and, where the field states a sigma, the
/// targets' coordinates. Robust first, then least squares over the targets that fit, each target with what it is off in
/// all images alike (variance_components.h). `dots`: where known, the eccentricity of a dot's image is taken out.
/// `start`: image size, pixel pitch, nominal focal length and principal point. Fails (invalid_input) when an image does
/// not belong to the others or to the camera stated, or when the images leave a constant open; says which.
Result<Calibration> calibrate_camera(const CameraModel& start, const std::vector<CalibrationImage>& images,
                                     const TargetField& field, const CalibrateConfig& config,
                                     const DotDiscs& dots = {});

}  // namespace imprint
