#pragma once

#include <array>
#include <string>

#include "lib/camera/camera_model.h"

namespace imprint::paper {

/// One column of [B] table 3: a camera's constants, their 95 % half-widths (A1 to C2, x0 and y0 in px, c in mm) and the
/// RMS of its space resection.
struct PublishedCamera {
  std::string id;
  std::array<double, 10> value;       ///< f in mm, x0, y0 in px, A1, A2, A3, B1, B2, C1, C2
  std::array<double, 10> half_width;  ///< in the same units
  double rms_px;
};

/// The two scales of [B]: the field, where the cameras stand (table 4) and what was reached (tables 4 and 5).
struct PublishedScale {
  std::string name;
  double distance_mm, base_mm, dot_diameter_mm, plate_mm;
  std::array<PublishedCamera, 2> cameras;
  std::array<std::array<double, 3>, 2> center_half_width_mm;  ///< table 4, 95 %
  std::array<double, 2> pose_rms_px;                          ///< table 4
  double e3d_rms_mm, e2d_mean_mm, e2d_max_mm, e2d_rms_mm;     ///< table 5
  double cold_rms_px, hot_rms_px;                             ///< 3.4 and figure 9
  double field_rms_mm;                                        ///< table 2
};

inline const PublishedScale kSmallScale{
    "small (1.5 x 1.5 x 0.5 m)",
    1400.0,
    600.0,
    5.0,
    22.0,
    {{{"cam1",
       {21.9000, 2361.17, 1742.01, -5.984e-3, 6.696e-4, -4.873e-5, -8.247e-5, 6.455e-5, 1.656e-4, 0.416e-4},
       {0.0009, 0.63, 0.57, 0.105e-3, 0.969e-4, 2.448e-5, 1.217e-5, 1.086e-5, 0.329e-4, 0.317e-4},
       0.071},
      {"cam2",
       {21.7704, 2280.51, 1737.05, -6.212e-3, 4.220e-4, 7.669e-5, 9.953e-5, -2.247e-5, 1.090e-4, 1.457e-4},
       {0.0017, 1.00, 0.85, 0.192e-3, 2.146e-4, 7.255e-5, 2.016e-5, 1.711e-5, 0.417e-4, 0.485e-4},
       0.095}}},
    {{{0.041, 0.055, 0.062}, {0.098, 0.068, 0.086}}},
    {0.055, 0.077},
    0.112,
    0.030,
    0.092,
    0.041,
    0.10,
    0.21,
    0.0097};

inline const PublishedScale kLargeScale{
    "large (6 x 6 x 2 m)",
    9000.0,
    2000.0,
    28.0,
    154.0,
    {{{"cam1",
       {21.7466, 2367.80, 1736.88, -6.325e-3, 5.246e-4, 1.301e-5, -8.541e-5, 6.500e-5, 1.231e-4, 1.216e-4},
       {0.0014, 1.08, 0.88, 0.151e-3, 1.439e-4, 3.865e-5, 2.150e-5, 1.773e-5, 0.378e-4, 0.369e-4},
       0.103},
      {"cam2",
       {21.5724, 2285.07, 1738.14, -6.787e-3, 6.435e-4, -2.371e-5, 9.160e-5, 0.448e-5, 1.596e-4, 0.529e-4},
       {0.0011, 0.86, 0.68, 0.142e-3, 1.449e-4, 4.282e-5, 1.740e-5, 1.435e-5, 0.299e-4, 0.296e-4},
       0.086}}},
    {{{0.70, 0.24, 0.60}, {0.51, 0.19, 0.57}}},
    {0.065, 0.051},
    2.303,
    0.240,
    0.389,
    0.254,
    0.11,
    0.25,
    0.2372};

inline constexpr double kPitch_um = 3.8;

/// The camera that the constants describe.
inline CameraModel camera_of(const PublishedCamera& published) {
  CameraModel camera;
  camera.id = published.id;
  camera.width_px = 4656;
  camera.height_px = 3520;
  camera.pixel_pitch_um = kPitch_um;
  const auto& v = published.value;
  camera.focal_length_px = 1000.0 * v[0] / kPitch_um;
  camera.principal_point = {v[1], v[2]};
  camera.distortion.radial = {v[3], v[4], v[5]};
  camera.distortion.tangential = {v[6], v[7]};
  camera.distortion.affine = {v[8], v[9]};
  return camera;
}

/// As engraved on the lens: 21 mm, no distortion, the principal point in the middle.
inline CameraModel nominal_of(const CameraModel& camera) {
  CameraModel nominal = camera;
  nominal.focal_length_px = 21000.0 / kPitch_um;
  nominal.principal_point = {0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)};
  nominal.distortion = {};
  return nominal;
}

}  // namespace imprint::paper
