#pragma once

#include "lib/camera/camera_model.h"

namespace imprint {

/// cam1 of [B] table 3, large scale.
inline CameraModel paper_camera() {
  CameraModel camera;
  camera.id = "cam1";
  camera.width_px = 4656;
  camera.height_px = 3520;
  camera.pixel_pitch_um = 3.8;
  camera.focal_length_px = 5722.79;
  camera.principal_point = {2367.8, 1736.88};
  camera.distortion.radial = {-6.325e-3, 5.246e-4, 1.301e-5};
  camera.distortion.tangential = {-8.541e-5, 6.5e-5};
  camera.distortion.affine = {1.231e-4, 1.216e-4};
  return camera;
}

/// The same as its maker states it: 21 mm, no distortion, the principal point in the middle.
inline CameraModel paper_camera_as_engraved() {
  CameraModel camera = paper_camera();
  camera.focal_length_px = 21000.0 / camera.pixel_pitch_um;
  camera.principal_point = {0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)};
  camera.distortion = {};
  return camera;
}

/// The same without the shear and the unequal scales that other programs' models lack.
inline CameraModel paper_camera_without_affine() {
  CameraModel camera = paper_camera();
  camera.distortion.affine = {};
  return camera;
}

}  // namespace imprint
