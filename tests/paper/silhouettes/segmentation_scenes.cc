#include "tests/paper/silhouettes/segmentation_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "simulation/layout.h"
#include "simulation/random.h"

namespace imprint::paper {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

class SceneMaker {
 public:
  SceneMaker(std::uint64_t seed, int index, bool empty)
      : random_(stream_seed(seed, empty ? "empty hall" : "segmentation", static_cast<std::uint64_t>(index))),
        strong_(index % 2 == 0) {
    scene_.name = "segmentation";
    scene_.seed = random_.bits();
    scene_.forging.present = !empty;
  }

  SegmentationScene make() {
    dark_ = chance(0.3);
    scene_.kind = dark_ ? SceneKind::laboratory : SceneKind::forge;
    note(dark_, "dark");
    shape();
    camera();
    turn();
    light();
    targets();
    if (chance(0.25)) jaw();
    if (chance(dark_ ? 0.5 : 0.15)) blocks();
    if (chance(0.3)) others();
    scene_.imaging = {8,   between(0.5, 1.6), between(0.0, 0.2), 30.0, between(4000, 20000), between(4, 25),
                      1.0, between(0.0, 0.25)};
    if (made_.kinds.empty()) made_.kinds.emplace_back("plain");
    made_.scene = scene_;
    return made_;
  }

 private:
  double between(double from, double to) { return random_.uniform(from, to); }
  bool chance(double share) { return random_.uniform() < share; }
  void note(bool given, const char* kind) {
    if (given) made_.kinds.emplace_back(kind);
  }

  void shape() {
    ForgingScene& f = scene_.forging;
    diameter_mm_ = between(120, 400);
    f.length_mm = diameter_mm_ * between(4, 9);
    const int stations = dark_ ? 1 : 1 + random_.index(5);
    double least = 1e9, most = 0.0;
    for (int i = 0; i < stations; ++i) {
      const double d = diameter_mm_ * between(0.6, 1.0);
      f.stations.push_back({i == 0 ? 0.0 : f.length_mm * (i + between(-0.25, 0.25)) / stations, d});
      least = std::min(least, d), most = std::max(most, d);
    }
    f.transition_mm = std::max(5.0, 0.15 * diameter_mm_);
    f.eccentricity_mm = 0.004 * diameter_mm_;
    f.bow_mm = between(0.0, 0.005) * f.length_mm;
    f.circularity_mm = between(0.0, 0.015) * diameter_mm_;
    f.press_marks = random_.index(14);
    f.press_mark_depth_mm = 0.007 * diameter_mm_;
    scene_.spec.diameter_min_mm = least * between(0.75, 0.95);
    scene_.spec.diameter_max_mm = most * between(1.05, 1.3);
    scene_.spec.polarity = dark_ ? Polarity::dark : Polarity::bright;
    scene_.spec.end_section_mm = 0.3 * diameter_mm_;
    scene_.observations.rotations_deg = {0.0};
    scene_.observations.position_error_mm = 0.0;
  }

  void camera() {
    constexpr std::array<int, 5> widths{1164, 1164, 1552, 1552, 2328};
    SceneCamera camera;
    CameraModel& model = camera.model;
    model.id = "cam1";
    model.width_px = widths[static_cast<std::size_t>(random_.index(5))];
    model.height_px = model.width_px * 3520 / 4656;
    model.pixel_pitch_um = 3.8 * 4656 / model.width_px;
    model.focal_length_px = model.width_px * between(1.1, 2.0);
    model.principal_point = {0.5 * (model.width_px - 1), 0.5 * (model.height_px - 1)};
    model.distortion.radial = {between(-7e-3, 0.0), between(-5e-4, 5e-4), 0.0};
    const bool cut_off = chance(0.15);
    const double share = cut_off ? between(0.8, 1.4) : between(0.35, 0.72);
    camera.distance_mm = model.focal_length_px * scene_.forging.length_mm / (share * model.width_px);
    note(cut_off, "cut off");
    camera.elevation_deg = chance(0.5) ? between(0, 60) : between(120, 180);
    camera.roll_deg = chance(0.5) ? between(-30, 30) : between(-2, 2);
    image_mm_ = camera.distance_mm * model.width_px / model.focal_length_px;
    // The forging lies above the floor, and the camera looks somewhere near its middle.
    scene_.forging.center_world_mm = {0, 0, 0.6 * image_mm_};
    const double across = cut_off ? 0.04 : 0.08;
    camera.aim_world_mm = scene_.forging.center_world_mm + Eigen::Vector3d(between(-across, across) * image_mm_,
                                                                           between(-across, across) * image_mm_,
                                                                           between(-across, across) * image_mm_);
    if (cut_off && chance(0.6)) {  // one end only
      const double shift = 0.5 * scene_.forging.length_mm + between(0.05, 0.2) * image_mm_ - 0.35 * image_mm_;
      camera.aim_world_mm.x() += (chance(0.5) ? 1 : -1) * std::max(0.0, shift);
    }
    scene_.cameras.push_back(camera);
  }

  // Turned in the image against the rig's direction by up to 30 deg, and a little towards the camera.
  void turn() {
    made_.tilt_deg = chance(0.6) ? between(-30, 30) : between(-3, 3);
    note(std::abs(made_.tilt_deg) > 10, "tilted");
    const double e = scene_.cameras[0].elevation_deg * kDegree, toward = between(-6, 6);
    scene_.forging.yaw_deg = std::clamp(-made_.tilt_deg * std::sin(e) + toward * std::cos(e), -30.0, 30.0);
    scene_.forging.pitch_deg = std::clamp(-made_.tilt_deg * std::cos(e) - toward * std::sin(e), -30.0, 30.0);
  }

  void light() {
    made_.contrast_levels = 25 * std::pow(170.0 / 25, random_.uniform());
    const double contrast = made_.contrast_levels / 255;
    const bool low = made_.contrast_levels < 40;
    note(low, "low contrast");
    SurfaceScene& s = scene_.surface;
    s.sparks = random_.index(15);
    s.halo = between(0.0, 0.03);
    s.limb_darkening = between(0.0, 0.3);
    s.temperature_drop_c = low ? between(0, 10) : between(0, 60);
    s.scale_coverage = chance(0.3) ? 0.0 : between(0.0, low ? 0.1 : 0.25);
    scene_.backdrop.clutter = between(0.2, 1.8);
    if (dark_) {
      s.level = between(0.02, 0.12);  // a black tube; little light on the wall makes low contrast
      scene_.backdrop.level = s.level + contrast;
      s.scale_coverage *= 0.2;
      scene_.backdrop.strong_level = s.level * between(0.0, 0.7);
    } else {
      scene_.backdrop.level = between(0.02, 0.08);
      s.level = scene_.backdrop.level + contrast;
      if (s.scale_coverage > 0) s.level += 0.4 * contrast;  // what the film on a scaled surface takes away
      scene_.backdrop.strong_level = std::min(1.2, s.level * between(1.2, 2.5));
    }
    if (strong_) scene_.backdrop.strong_clutter = between(0.4, 1.4);
    note(strong_, "clutter");
  }

  void targets() {
    const SceneCamera& camera = scene_.cameras[0];
    TargetScene& t = scene_.targets;
    t.per_camera = 10 + random_.index(8);
    t.dot_diameter_mm = between(13, 17) * camera.distance_mm / camera.model.focal_length_px;
    t.plate_mm = 4.2 * t.dot_diameter_mm;
    t.white_level = dark_ ? scene_.backdrop.level * between(0.8, 1.1) : between(0.2, 0.45);
  }

  void jaw() {
    JawScene& jaw = scene_.jaw;
    jaw.holds = chance(0.5) ? JawScene::End::first : JawScene::End::second;
    jaw.cover_mm = std::min(0.25 * scene_.forging.length_mm, between(0.4, 1.2) * diameter_mm_);
    if (dark_) jaw.level = scene_.backdrop.level * between(0.1, 0.8);
    if (!dark_)
      jaw.level = chance(0.5) ? scene_.backdrop.level * between(0.3, 1.5)
                              : scene_.backdrop.level + between(0.2, 0.7) * made_.contrast_levels / 255;
    note(true, "jaw");
  }

  void blocks() {
    BlockScene& b = scene_.v_blocks;
    const double length = scene_.forging.length_mm;
    b.at_mm = {length * between(0.12, 0.3), length * between(0.7, 0.88)};
    b.width_mm = diameter_mm_ * between(0.2, 0.5);
    b.level = scene_.backdrop.level * (dark_ ? between(0.2, 1.1) : between(0.3, 2.0));
    note(true, "v-blocks");
  }

  // Bodies that are much wider or narrower than the rig's range; now and then one of the forging's own kind that lies
  // farther away and aside, which only where it lies can tell from it.
  void others() {
    const SceneCamera& camera = scene_.cameras[0];
    const double e = camera.elevation_deg * kDegree;
    const Eigen::Vector3d away(0, -std::cos(e), -std::sin(e)), beside(0, -std::sin(e), std::cos(e));
    const auto level = [&] {
      return dark_ ? scene_.surface.level * between(0.5, 1.5)
                   : std::min(1.1, scene_.backdrop.level + made_.contrast_levels / 255 * between(0.5, 2.0));
    };
    const int count = 1 + random_.index(2);
    for (int i = 0; i < count; ++i) {
      OtherBody o;
      o.level = level();
      const double side = chance(0.5) ? 1 : -1;
      const double which = random_.uniform();
      double farther = between(1.0, 1.4);
      if (which < 0.35) {  // an ingot
        o.diameter_mm = scene_.spec.diameter_max_mm * farther * between(1.9, 2.6);
        o.length_mm = o.diameter_mm * between(1.0, 3.0);
      } else if (which < 0.7) {  // a bar
        o.diameter_mm = scene_.spec.diameter_min_mm * between(0.2, 0.5);
        o.length_mm = scene_.forging.length_mm * between(0.4, 1.3);
      } else if (which < 0.85 || !scene_.forging.present) {  // an open furnace
        o.flat = true;
        o.diameter_mm = scene_.spec.diameter_max_mm * farther * between(1.9, 3.0);
        o.length_mm = o.diameter_mm * between(0.8, 1.5);
      } else {
        farther = between(1.35, 1.6);
        o.diameter_mm = diameter_mm_ * between(0.7, 1.0);
        o.length_mm = scene_.forging.length_mm * between(0.5, 1.0);
        note(true, "second");
      }
      o.yaw_deg = scene_.forging.yaw_deg + between(-20, 20), o.pitch_deg = scene_.forging.pitch_deg + between(-20, 20);
      const double apart = 0.5 * diameter_mm_ + 0.5 * o.diameter_mm + between(0.08, 0.2) * image_mm_;
      o.center_world_mm =
          scene_.forging.center_world_mm + side * apart * farther * beside + (farther - 1) * camera.distance_mm * away;
      o.center_world_mm.x() += between(-0.25, 0.25) * image_mm_;
      scene_.others.push_back(o);
    }
    note(true, "others");
  }

  Random random_;
  Scene scene_;
  SegmentationScene made_;
  bool strong_ = false, dark_ = false;
  double diameter_mm_ = 0.0, image_mm_ = 0.0;
};

}  // namespace

SegmentationScene segmentation_scene(std::uint64_t seed, int index, bool empty) {
  return SceneMaker(seed, index, empty).make();
}

}  // namespace imprint::paper
