#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "lib/camera/camera_model.h"
#include "lib/rig/rig.h"

namespace imprint {

enum class SceneKind {
  forge,       ///< glowing forging in a dark hall
  laboratory,  ///< dark tube before a white wall
};

/// One stretch of nominal diameter, from `start_mm` to the start of the next.
struct Station {
  double start_mm = 0.0;
  double diameter_mm = 0.0;
};

/// The body whose geometry is the truth. Lengths in mm.
struct ForgingScene {
  bool present = true;  ///< false: an empty hall; everything else stands as if the forging lay there
  double length_mm = 1900.0;
  std::vector<Station> stations;  ///< ascending, the first at 0
  double transition_mm = 30.0;    ///< length of a step; longer where the step is high, so that no camera sees behind it
  double eccentricity_mm = 1.0;   ///< largest offset of a stretch's centre from the axis curve
  double bow_mm = 8.0;            ///< rise of the smooth bow
  double kink_mm = 0.0;           ///< rise of a local bend, on top of the bow
  double circularity_mm = 5.0;    ///< (largest - smallest width) / 2 of the worst section, before press marks
  int press_marks = 12;           ///< shallow flats at random places
  double press_mark_depth_mm = 2.0;  ///< deepest
  int faces = 0;                     ///< 0: round; else the sections are regular polygons, diameters are across faces
  double corner_radius_mm = 25.0;    ///< of sections with faces
  double face_bulge_mm = 0.1;        ///< how far the middle of a face stands out from its edges
  Eigen::Vector3d center_world_mm{0.0, 0.0, 1000.0};  ///< where the middle of the ideal axis should be
  double yaw_deg = 0.0;                               ///< of the ideal axis, about world z
  double pitch_deg = 0.0;                             ///< of the ideal axis, first end up
};

/// How the body looks.
struct SurfaceScene {
  double temperature_c = 1000.0;     ///< hottest part of the clean surface
  double temperature_drop_c = 60.0;  ///< how much cooler the cooler end is
  double level = 0.8;                ///< share of full scale of a clean surface (forge: at temperature_c)
  double limb_darkening = 0.25;      ///< u of 1 - u (1 - cos)
  double scale_coverage = 0.18;      ///< share of the surface under dark scale
  double scale_drop_c = 190.0;       ///< how much colder scale looks
  double halo = 0.02;                ///< share of the light that the optics and the air spread widely
  int sparks = 30;
};

/// What happens between the scene and the file.
struct ImagingScene {
  int bits = 8;
  double blur_sigma_px = 0.8;    ///< of the Gaussian point spread function
  double haze_rms_px = 0.15;     ///< displacement by hot air in each direction, where it is not stronger
  double haze_grid_px = 40.0;    ///< size of its features
  double full_well_e = 20000.0;  ///< electrons at full scale
  double read_noise_e = 4.0;
  double noise = 1.0;       ///< factor of shot and read noise; 0: none
  double vignetting = 0.2;  ///< loss at the corner
  double exposure = 1.0;    ///< light that is collected, against what the levels of the scene mean
};

struct TargetScene {
  int per_camera = 22;
  double dot_diameter_mm = 28.0;
  double plate_mm = 154.0;
  double max_tilt_deg = 30.0;  ///< of a plate against the line of sight of its camera
  double depth_spread = 0.2;   ///< of the distance, share of the camera's
  double white_level = 0.35;
  double dirty_fraction = 0.12;
  double hidden_fraction = 0.08;
  std::filesystem::path library;  ///< empty: a library of its own
};

struct BackdropScene {
  double level = 0.05;          ///< mean grey of the hall or the wall, share of full scale
  double clutter = 1.0;         ///< density of beams, boxes, lamps and bright bars; 0: an even wall
  double strong_clutter = 0.0;  ///< density of windows, lit beams and gratings (laboratory: black ones) of strong_level
  double strong_level = 0.9;    ///< share of full scale
};

/// A manipulator that holds one end between two V-shaped jaws.
struct JawScene {
  enum class End { none, first, second };
  End holds = End::none;
  double cover_mm = 250.0;  ///< of the forging's length lies between the jaws
  double level = 0.03;      ///< share of full scale
};

/// V-shaped blocks that the forging lies on.
struct BlockScene {
  std::vector<double> at_mm;  ///< their middles along the forging
  double width_mm = 80.0;     ///< along the forging
  double level = 0.2;         ///< share of full scale
};

/// Another hot body (laboratory: another dark one).
struct OtherBody {
  bool flat = false;  ///< a door or opening that faces world y instead of a round bar
  Eigen::Vector3d center_world_mm = Eigen::Vector3d::Zero();
  double length_mm = 1000.0;
  double diameter_mm = 200.0;             ///< flat: height
  double yaw_deg = 0.0, pitch_deg = 0.0;  ///< of its axis, as the forging's
  double level = 0.8;                     ///< share of full scale
};

struct ObservationScene {
  std::vector<double> rotations_deg{0.0, 60.0, 120.0};
  double position_error_mm = 1.0;   ///< each coordinate uniform within +- this
  double rotation_error_deg = 0.5;  ///< about the axis, uniform within +- this
  double tilt_error_deg = 0.03;     ///< yaw and pitch, uniform within +- this
};

struct SceneCamera {
  CameraModel model;
  double distance_mm = 0.0;    ///< from the point it looks at
  double elevation_deg = 0.0;  ///< of the camera about world x, from +y towards +z
  double offset_x_mm = 0.0;    ///< along world x, against the point it looks at
  double roll_deg = 0.0;       ///< about its optical axis
  Eigen::Vector3d aim_world_mm{0.0, 0.0, 1000.0};
};

/// Everything a scene file says, read and checked; docs/scene.md.
struct Scene {
  std::string name;
  SceneKind kind = SceneKind::forge;
  std::uint64_t seed = 1;
  double corruption = 1.0;  ///< factor of scale, sparks, haze, dirty and hidden targets
  ForgingScene forging;
  SurfaceScene surface;
  ImagingScene imaging;
  TargetScene targets;
  BackdropScene backdrop;
  JawScene jaw;
  BlockScene v_blocks;
  std::vector<OtherBody> others;
  ObservationScene observations;
  ForgingSpec spec;  ///< what rig.toml tells the measurement
  std::vector<SceneCamera> cameras;

  [[nodiscard]] int camera_index(std::string_view id) const;  ///< -1 when there is none
};

}  // namespace imprint
