#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

namespace imprint {

/// A point of the circle that bounds one end face, read by one camera.
struct EndPoint {
  int observation = 0;
  bool last = false;                                    ///< the end with the larger x
  double x_mm = 0.0;                                    ///< along the forging's line
  Eigen::Vector2d beside_mm = Eigen::Vector2d::Zero();  ///< y, z from the axis there
  double sigma_mm = 0.0;                                ///< of x
};

/// One end face: x = x_mm + tilt . (y, z), measured from the axis.
struct EndPlane {
  double x_mm = 0.0;
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
  bool seen = false;  ///< by at least one reading
};

struct EndPlanes {
  EndPlane first, last;
  Eigen::Matrix2d covariance_mm2 = Eigen::Matrix2d::Zero();  ///< of the two x
  std::vector<double> shift_mm;                              ///< to add to each observation's x; the first one's is 0
  [[nodiscard]] double length_sigma_mm() const;
};

struct EndPriors {
  double tilt_sigma_rad = 0.0087;  ///< of a face against the ideal axis
  double shift_sigma_mm = 50.0;    ///< of an observation along the axis
  double scatter_mm = 0.1;         ///< readings are never trusted better than this
};

/// Both end faces and the shift of every observation along the axis, by robust least squares of all readings.
EndPlanes fit_end_planes(std::span<const EndPoint> points, int observations, const EndPriors& priors);

}  // namespace imprint
