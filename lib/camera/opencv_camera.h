#pragma once

#include <array>

#include "lib/camera/camera_model.h"
#include "lib/result/result.h"

namespace imprint {

/// OpenCV's pinhole camera ("plumb_bob" and "rational_polynomial" of ROS), of the same pixel origin as ours:
///   px = fx x'' + cx, py = fy y'' + cy of the ideal (x', y') = (X/Z, Y/Z), with r^2 = x'^2 + y'^2,
///   x'' = x' radial + 2 p1 x'y' + p2 (r^2 + 2x'^2) + s1 r^2 + s2 r^4,
///   y'' = y' radial + p1 (r^2 + 2y'^2) + 2 p2 x'y' + s3 r^2 + s4 r^4,
///   radial = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6).
struct OpenCvCamera {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0;
  std::array<double, 12> distortion{};  ///< in OpenCV's order: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4
};

/// Where OpenCV's camera shows the direction (x, y, 1).
ObservedPoint project(const OpenCvCamera& camera, double x, double y);

struct OpenCvConversion {
  OpenCvCamera camera;
  double max_error_px = 0.0;  ///< largest distance between the two models over the image
};

/// Our camera in OpenCV's terms. Without C1 and C2 the two are the same but for notation: with g = f/n and
/// K = 1 - A1 q - A2 q^2 - A3 q^3 (contract section 1), fx = fy = f K, k_i = A_i g^2i / K, p1 = B2 g / K, p2 = B1 g /
/// K. C1 is what fx and fy differ by, nearly; for C2, a shear, OpenCV has no term. Least squares over the image then;
/// the axes of the camera stay.
OpenCvConversion to_opencv(const CameraModel& camera);

struct BalancedConversion {
  CameraModel camera;  ///< without id and pixel pitch
  double max_error_px = 0.0;
};

/// OpenCV's camera in our terms: exact for k1, k2, k3, p1, p2 with fx = fy, else by least squares over the image.
/// Fails (invalid_input) when the distortion folds the image, so that a pixel has no ray.
Result<BalancedConversion> from_opencv(const OpenCvCamera& camera);

}  // namespace imprint
