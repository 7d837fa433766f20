#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <opencv2/core.hpp>

#include "lib/camera/camera_model.h"
#include "lib/camera/camera_pose.h"
#include "lib/result/result.h"
#include "simulation/layout.h"
#include "simulation/scene.h"

namespace imprint {

/// A target field and how somebody walks round it with a camera. Lengths in mm.
struct FieldPhotosScene {
  std::uint64_t seed = 1;
  int targets = 40;
  int photos = 60;
  Eigen::Vector3d size_mm{6000.0, 6000.0, 2000.0};  ///< of the field, standing on the floor round the world's origin
  double distance_mm = 6000.0;                      ///< of the photographer from its middle
  CameraModel camera;
  TargetScene target;    ///< the plates; only the sizes, the grey and the library count
  ImagingScene imaging;  ///< no hot air in it
  BackdropScene backdrop;
};

/// A length between two plates, exact.
struct FieldBar {
  int id_a = 0, id_b = 0;
  double length_mm = 0.0;
};

/// The scene fixed: plates, bars of about 2 m and 1 m on the floor, where each photograph is taken from.
struct FieldPhotos {
  Scene scene;  ///< one camera a photograph
  Layout layout;
  std::vector<FieldBar> bars;
};

/// Plates upright on stands and lying on the floor, photographs from a half circle at three heights, the camera turned
/// upright every other time. Fails (invalid_input) when the library has too few codes or the plates find no room.
Result<FieldPhotos> lay_out_field(const FieldPhotosScene& scene);

/// One photograph, 8 or 16 bit.
Result<cv::Mat> render_field_photo(const FieldPhotos& photos, int index);

}  // namespace imprint
