#include <algorithm>
#include <initializer_list>
#include <set>

#include "lib/config/toml_file.h"
#include "simulation/scene.h"
#include "simulation/simulation.h"

namespace imprint {
namespace {

// A misspelt key would silently leave a default in place: name it instead.
void know_keys(TomlReader& read, const toml::table& table, const std::string& section,
               std::initializer_list<std::string_view> keys) {
  const toml::node* node = section.empty() ? &table : table.get(section);
  if (node == nullptr) return;
  const toml::table* entries = node->as_table();
  if (entries == nullptr) return read.fault(section, "expected a table, headed [" + section + "]");
  for (const auto& [key, value] : *entries) {
    const std::string_view name = key.str();
    if (std::find(keys.begin(), keys.end(), name) != keys.end()) continue;
    read.fault(section.empty() ? std::string(name) : section + "." + std::string(name),
               "unknown key; docs/scene.md lists those there are");
  }
}

double within(TomlReader& read, std::string_view key, double fallback, double least, double most) {
  const double value = read.number(key, fallback);
  if (!(value >= least && value <= most))
    read.fault(key, fmt::format("expected {} to {}, found {}", least, most, value));
  return value;
}

int whole(TomlReader& read, std::string_view key, int fallback, int least, int most) {
  const auto value = read.integer(key, fallback);
  if (value < least || value > most) read.fault(key, fmt::format("expected {} to {}, found {}", least, most, value));
  return static_cast<int>(std::clamp<std::int64_t>(value, least, most));
}

Eigen::Vector3d vector(TomlReader& read, std::string_view key, const Eigen::Vector3d& fallback) {
  const auto v = read.numbers(key, 3, std::vector<double>{fallback.x(), fallback.y(), fallback.z()});
  return {v[0], v[1], v[2]};
}

void read_stations(TomlReader& read, const toml::table& table, ForgingScene& forging) {
  const toml::array* list = table.at_path("forging.stations").as_array();
  if (list == nullptr || list->empty())
    return read.fault("forging.stations", "expected a list of [start_mm, diameter_mm]");
  for (const toml::node& entry : *list) {
    const toml::array* pair = entry.as_array();
    if (pair == nullptr || pair->size() != 2 || !pair->get(0)->is_number() || !pair->get(1)->is_number()) {
      return read.fault("forging.stations", "expected a list of [start_mm, diameter_mm]");
    }
    const double start = pair->get(0)->value_or(-1.0), diameter = pair->get(1)->value_or(-1.0);
    const bool first = forging.stations.empty();
    if (first ? start != 0.0 : !(start > forging.stations.back().start_mm && start < forging.length_mm)) {
      return read.fault("forging.stations",
                        fmt::format("expected starts that ascend from 0 and stay below length_mm ({}), found {}",
                                    forging.length_mm, start));
    }
    if (!(diameter >= 1.0 && diameter <= forging.length_mm)) {
      return read.fault("forging.stations", fmt::format("expected diameters of 1 mm to length_mm ({}), found {}",
                                                        forging.length_mm, diameter));
    }
    forging.stations.push_back({start, diameter});
  }
}

ForgingScene read_forging(TomlReader& read, const toml::table& table) {
  know_keys(read, table, "forging",
            {"present", "length_mm", "stations", "transition_mm", "eccentricity_mm", "bow_mm", "kink_mm",
             "circularity_mm", "press_marks", "press_mark_depth_mm", "faces", "corner_radius_mm", "face_bulge_mm",
             "center_mm", "yaw_deg", "pitch_deg"});
  ForgingScene f;
  f.present = read.boolean("forging.present", f.present);
  f.length_mm = within(read, "forging.length_mm", f.length_mm, 10.0, 50000.0);
  read_stations(read, table, f);
  f.transition_mm = within(read, "forging.transition_mm", f.transition_mm, 0.5, f.length_mm);
  f.eccentricity_mm = within(read, "forging.eccentricity_mm", f.eccentricity_mm, 0.0, 0.02 * f.length_mm);
  f.bow_mm = within(read, "forging.bow_mm", f.bow_mm, 0.0, 0.05 * f.length_mm);
  f.kink_mm = within(read, "forging.kink_mm", f.kink_mm, 0.0, 0.05 * f.length_mm);
  f.circularity_mm = within(read, "forging.circularity_mm", f.circularity_mm, 0.0, 0.1 * f.length_mm);
  f.press_marks = whole(read, "forging.press_marks", f.press_marks, 0, 500);
  f.press_mark_depth_mm = within(read, "forging.press_mark_depth_mm", f.press_mark_depth_mm, 0.0, 0.05 * f.length_mm);
  f.faces = whole(read, "forging.faces", f.faces, 0, 12);
  if (f.faces % 2 != 0 || f.faces == 2)
    read.fault("forging.faces", fmt::format("expected 0 (round), 4, 6, 8, 10 or 12, found {}", f.faces));
  f.corner_radius_mm = within(read, "forging.corner_radius_mm", f.corner_radius_mm, 0.1, f.length_mm);
  f.face_bulge_mm = within(read, "forging.face_bulge_mm", f.face_bulge_mm, 0.01, 0.01 * f.length_mm);
  f.center_world_mm = vector(read, "forging.center_mm", f.center_world_mm);
  f.yaw_deg = within(read, "forging.yaw_deg", f.yaw_deg, -30.0, 30.0);
  f.pitch_deg = within(read, "forging.pitch_deg", f.pitch_deg, -30.0, 30.0);
  return f;
}

SurfaceScene read_surface(TomlReader& read, const toml::table& table) {
  know_keys(read, table, "surface",
            {"temperature_c", "temperature_drop_c", "level", "limb_darkening", "scale_coverage", "scale_drop_c", "halo",
             "sparks"});
  SurfaceScene s;
  s.temperature_c = within(read, "surface.temperature_c", s.temperature_c, 600.0, 1300.0);
  s.temperature_drop_c = within(read, "surface.temperature_drop_c", s.temperature_drop_c, 0.0, 300.0);
  s.level = within(read, "surface.level", s.level, 0.0, 2.0);
  s.limb_darkening = within(read, "surface.limb_darkening", s.limb_darkening, 0.0, 1.0);
  s.scale_coverage = within(read, "surface.scale_coverage", s.scale_coverage, 0.0, 0.9);
  s.scale_drop_c = within(read, "surface.scale_drop_c", s.scale_drop_c, 0.0, 400.0);
  s.halo = within(read, "surface.halo", s.halo, 0.0, 0.5);
  s.sparks = whole(read, "surface.sparks", s.sparks, 0, 10000);
  return s;
}

ImagingScene read_imaging(TomlReader& read, const toml::table& table) {
  know_keys(read, table, "imaging",
            {"bits", "blur_sigma_px", "haze_rms_px", "haze_grid_px", "full_well_e", "read_noise_e", "noise",
             "vignetting", "exposure"});
  ImagingScene i;
  i.bits = whole(read, "imaging.bits", i.bits, 8, 16);
  if (i.bits != 8 && i.bits != 16) read.fault("imaging.bits", fmt::format("expected 8 or 16, found {}", i.bits));
  i.blur_sigma_px = within(read, "imaging.blur_sigma_px", i.blur_sigma_px, 0.0, 10.0);
  i.haze_rms_px = within(read, "imaging.haze_rms_px", i.haze_rms_px, 0.0, 3.0);
  i.haze_grid_px = within(read, "imaging.haze_grid_px", i.haze_grid_px, 8.0, 1000.0);
  i.full_well_e = within(read, "imaging.full_well_e", i.full_well_e, 100.0, 1e7);
  i.read_noise_e = within(read, "imaging.read_noise_e", i.read_noise_e, 0.0, 1000.0);
  i.noise = within(read, "imaging.noise", i.noise, 0.0, 20.0);
  i.vignetting = within(read, "imaging.vignetting", i.vignetting, 0.0, 0.9);
  i.exposure = within(read, "imaging.exposure", i.exposure, 1e-3, 1e3);
  return i;
}

TargetScene read_targets(TomlReader& read, const toml::table& table) {
  know_keys(read, table, "targets",
            {"per_camera", "dot_diameter_mm", "plate_mm", "max_tilt_deg", "depth_spread", "white_level",
             "dirty_fraction", "hidden_fraction", "library"});
  TargetScene t;
  t.per_camera = whole(read, "targets.per_camera", t.per_camera, 0, 200);
  t.dot_diameter_mm = within(read, "targets.dot_diameter_mm", t.dot_diameter_mm, 0.1, 1000.0);
  t.plate_mm = within(read, "targets.plate_mm", t.plate_mm, 3.0 * t.dot_diameter_mm, 5000.0);
  t.max_tilt_deg = within(read, "targets.max_tilt_deg", t.max_tilt_deg, 0.0, 55.0);
  t.depth_spread = within(read, "targets.depth_spread", t.depth_spread, 0.0, 0.45);
  t.white_level = within(read, "targets.white_level", t.white_level, 0.0, 1.0);
  t.dirty_fraction = within(read, "targets.dirty_fraction", t.dirty_fraction, 0.0, 1.0);
  t.hidden_fraction = within(read, "targets.hidden_fraction", t.hidden_fraction, 0.0, 1.0);
  if (read.has("targets.library")) t.library = read.path("targets.library");
  return t;
}

BackdropScene read_backdrop(TomlReader& read, const toml::table& table) {
  know_keys(read, table, "backdrop", {"level", "clutter", "strong_clutter", "strong_level"});
  BackdropScene b;
  b.level = within(read, "backdrop.level", b.level, 0.0, 1.0);
  b.clutter = within(read, "backdrop.clutter", b.clutter, 0.0, 10.0);
  b.strong_clutter = within(read, "backdrop.strong_clutter", b.strong_clutter, 0.0, 10.0);
  b.strong_level = within(read, "backdrop.strong_level", b.strong_level, 0.0, 2.0);
  return b;
}

JawScene read_jaw(TomlReader& read, const toml::table& table, double length_mm) {
  know_keys(read, table, "jaw", {"holds", "cover_mm", "level"});
  JawScene j;
  const std::string end = read.string("jaw.holds", "none");
  if (end != "none" && end != "first" && end != "second")
    read.fault("jaw.holds", fmt::format("expected \"none\", \"first\" or \"second\", found \"{}\"", end));
  j.holds = end == "first" ? JawScene::End::first : end == "second" ? JawScene::End::second : JawScene::End::none;
  j.cover_mm = within(read, "jaw.cover_mm", std::min(j.cover_mm, 0.5 * length_mm), 1.0, 0.5 * length_mm);
  j.level = within(read, "jaw.level", j.level, 0.0, 2.0);
  return j;
}

BlockScene read_blocks(TomlReader& read, const toml::table& table, double length_mm) {
  know_keys(read, table, "v_blocks", {"at_mm", "width_mm", "level"});
  BlockScene b;
  b.at_mm = read.numbers("v_blocks.at_mm", 0, b.at_mm);
  for (const double at : b.at_mm) {
    if (!(at >= 0.0 && at <= length_mm))
      read.fault("v_blocks.at_mm", fmt::format("expected 0 to length_mm ({}), found {}", length_mm, at));
  }
  b.width_mm = within(read, "v_blocks.width_mm", b.width_mm, 1.0, 5000.0);
  b.level = within(read, "v_blocks.level", b.level, 0.0, 2.0);
  return b;
}

OtherBody read_other(TomlReader& read, const toml::table& entry) {
  know_keys(read, entry, "", {"shape", "center_mm", "length_mm", "diameter_mm", "yaw_deg", "pitch_deg", "level"});
  OtherBody o;
  const std::string shape = read.string("shape", "round");
  if (shape != "round" && shape != "flat")
    read.fault("shape", fmt::format("expected \"round\" or \"flat\", found \"{}\"", shape));
  o.flat = shape == "flat";
  const auto center = read.numbers("center_mm", 3);
  o.center_world_mm = {center[0], center[1], center[2]};
  o.length_mm = within(read, "length_mm", o.length_mm, 1.0, 50000.0);
  o.diameter_mm = within(read, "diameter_mm", o.diameter_mm, 1.0, 20000.0);
  o.yaw_deg = within(read, "yaw_deg", o.yaw_deg, -180.0, 180.0);
  o.pitch_deg = within(read, "pitch_deg", o.pitch_deg, -90.0, 90.0);
  o.level = within(read, "level", o.level, 0.0, 2.0);
  return o;
}

ObservationScene read_observations(TomlReader& read, const toml::table& table) {
  know_keys(read, table, "observations",
            {"rotations_deg", "position_error_mm", "rotation_error_deg", "tilt_error_deg"});
  ObservationScene o;
  o.rotations_deg = read.numbers("observations.rotations_deg", 0, o.rotations_deg);
  if (o.rotations_deg.empty() || o.rotations_deg.size() > 100)
    read.fault("observations.rotations_deg", "expected 1 to 100 angles");
  o.position_error_mm = within(read, "observations.position_error_mm", o.position_error_mm, 0.0, 100.0);
  o.rotation_error_deg = within(read, "observations.rotation_error_deg", o.rotation_error_deg, 0.0, 20.0);
  o.tilt_error_deg = within(read, "observations.tilt_error_deg", o.tilt_error_deg, 0.0, 5.0);
  return o;
}

ForgingSpec read_spec(TomlReader& read, const toml::table& table, SceneKind kind) {
  know_keys(read, table, "rig", {"diameter_mm", "end_section_mm", "axis_direction"});
  ForgingSpec spec;
  const auto diameters = read.numbers("rig.diameter_mm", 2);
  spec.diameter_min_mm = diameters[0];
  spec.diameter_max_mm = diameters[1];
  if (!(diameters[0] > 0.0 && diameters[1] >= diameters[0]))
    read.fault("rig.diameter_mm", "expected [smallest, largest] above 0");
  spec.end_section_mm = within(read, "rig.end_section_mm", spec.end_section_mm, 0.1, 10000.0);
  spec.axis_direction_world = vector(read, "rig.axis_direction", Eigen::Vector3d::UnitX());
  if (spec.axis_direction_world.norm() < 1e-9)
    read.fault("rig.axis_direction", "expected a direction, found a vector of length 0");
  spec.axis_direction_world.normalize();
  spec.polarity = kind == SceneKind::forge ? Polarity::bright : Polarity::dark;
  return spec;
}

SceneCamera read_camera(TomlReader& read, const toml::table& entry, const Eigen::Vector3d& center) {
  know_keys(read, entry, "",
            {"id", "width_px", "height_px", "pixel_pitch_um", "focal_length_px", "principal_point_px", "distortion",
             "distance_mm", "elevation_deg", "offset_x_mm", "roll_deg", "aim_mm"});
  know_keys(read, entry, "distortion", {"r0", "radial", "tangential", "affine"});
  SceneCamera camera;
  CameraModel& model = camera.model;
  model.id = read.string("id");
  const bool plain = !model.id.empty() &&
                     model.id.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
                         std::string::npos;
  if (!plain) read.fault("id", "expected letters, digits, - and _: it becomes part of file names");
  model.width_px = whole(read, "width_px", 4656, 64, 20000);
  model.height_px = whole(read, "height_px", 3520, 64, 20000);
  model.pixel_pitch_um = within(read, "pixel_pitch_um", 3.8, 0.1, 1000.0);
  model.focal_length_px = read.number("focal_length_px");
  if (!(model.focal_length_px > 0.1 * model.width_px))
    read.fault("focal_length_px", "expected at least a tenth of the image's width");
  const auto principal = read.numbers("principal_point_px", 2,
                                      std::vector<double>{0.5 * (model.width_px - 1), 0.5 * (model.height_px - 1)});
  model.principal_point = {principal[0], principal[1]};
  model.distortion.r0 = read.number("distortion.r0", model.distortion.r0);
  const auto radial = read.numbers("distortion.radial", 3, std::vector<double>(3, 0.0));
  const auto tangential = read.numbers("distortion.tangential", 2, std::vector<double>(2, 0.0));
  const auto affine = read.numbers("distortion.affine", 2, std::vector<double>(2, 0.0));
  std::copy(radial.begin(), radial.end(), model.distortion.radial.begin());
  std::copy(tangential.begin(), tangential.end(), model.distortion.tangential.begin());
  std::copy(affine.begin(), affine.end(), model.distortion.affine.begin());
  camera.distance_mm = read.number("distance_mm");
  if (!(camera.distance_mm > 1.0)) read.fault("distance_mm", "expected the distance from the point it looks at, in mm");
  camera.elevation_deg = read.number("elevation_deg");
  camera.offset_x_mm = read.number("offset_x_mm", 0.0);
  camera.roll_deg = read.number("roll_deg", 0.0);
  camera.aim_world_mm = vector(read, "aim_mm", center);
  return camera;
}

void check_sections(TomlReader& read, const Scene& scene) {
  double smallest = 1e30;
  for (const Station& station : scene.forging.stations) smallest = std::min(smallest, station.diameter_mm);
  if (scene.forging.circularity_mm > 0.2 * smallest) {
    read.fault("forging.circularity_mm", fmt::format("expected at most a fifth of the smallest diameter ({}), found {}",
                                                     smallest, scene.forging.circularity_mm));
  }
  if (scene.forging.faces > 0 && scene.forging.corner_radius_mm + scene.forging.face_bulge_mm > 0.4 * smallest) {
    read.fault("forging.corner_radius_mm",
               fmt::format("expected at most two fifths of the smallest width ({}), found {}", smallest,
                           scene.forging.corner_radius_mm));
  }
  if (2.0 * scene.spec.end_section_mm > scene.forging.length_mm) {
    read.fault("rig.end_section_mm", fmt::format("expected at most half of length_mm ({}), found {}",
                                                 scene.forging.length_mm, scene.spec.end_section_mm));
  }
}

}  // namespace

int Scene::camera_index(std::string_view id) const {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].model.id == id) return static_cast<int>(i);
  }
  return -1;
}

Result<Scene> read_scene(const std::filesystem::path& path) {
  const auto table = parse_toml_file(path);
  if (!table) return pass_on(table.error());
  TomlReader read(path, *table);
  know_keys(read, *table, "",
            {"scene", "forging", "surface", "imaging", "targets", "backdrop", "observations", "rig", "camera", "jaw",
             "v_blocks", "other"});
  know_keys(read, *table, "scene", {"name", "kind", "seed", "corruption"});
  Scene scene;
  scene.name = read.string("scene.name", path.stem().string());
  const std::string kind = read.string("scene.kind");
  if (kind != "forge" && kind != "laboratory")
    read.fault("scene.kind", fmt::format("expected \"forge\" or \"laboratory\", found \"{}\"", kind));
  scene.kind = kind == "laboratory" ? SceneKind::laboratory : SceneKind::forge;
  scene.seed = static_cast<std::uint64_t>(read.integer("scene.seed", 1));
  scene.corruption = within(read, "scene.corruption", 1.0, 0.0, 10.0);
  scene.forging = read_forging(read, *table);
  scene.surface = read_surface(read, *table);
  scene.imaging = read_imaging(read, *table);
  scene.targets = read_targets(read, *table);
  scene.backdrop = read_backdrop(read, *table);
  scene.jaw = read_jaw(read, *table, scene.forging.length_mm);
  scene.v_blocks = read_blocks(read, *table, scene.forging.length_mm);
  scene.observations = read_observations(read, *table);
  scene.spec = read_spec(read, *table, scene.kind);
  if (!read.error()) check_sections(read, scene);
  const auto entries = read.tables("camera"), others = read.tables("other");
  if (entries.empty()) read.fault("camera", "expected at least one camera, headed [[camera]]");
  if (read.error()) return pass_on(*read.error());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    TomlReader read_entry(path, *entries[i], fmt::format("camera[{}].", i));
    SceneCamera camera = read_camera(read_entry, *entries[i], scene.forging.center_world_mm);
    if (scene.camera_index(camera.model.id) >= 0)
      read_entry.fault("id", fmt::format("\"{}\" stands there twice", camera.model.id));
    if (read_entry.error()) return pass_on(*read_entry.error());
    scene.cameras.push_back(std::move(camera));
  }
  for (std::size_t i = 0; i < others.size(); ++i) {
    TomlReader read_entry(path, *others[i], fmt::format("other[{}].", i));
    scene.others.push_back(read_other(read_entry, *others[i]));
    if (read_entry.error()) return pass_on(*read_entry.error());
  }
  return scene;
}

}  // namespace imprint
