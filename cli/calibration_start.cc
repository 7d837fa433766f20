#include "cli/calibration_start.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lib/adjust/calibration_review.h"
#include "node/resect/resect.h"

namespace imprint {
namespace {

// Whether those of the field's targets that the image shows stand on one line: they fit any turn about it.
bool on_one_line(const std::vector<DetectedTarget>& targets, const TargetField& field) {
  CalibrationImage image;
  for (const DetectedTarget& target : targets) image.points.push_back({target.id, target.center, target.sigma_px});
  const auto known = std::ranges::count_if(targets, [&](const auto& t) { return field.targets.contains(t.id); });
  constexpr double kOnALine = 0.02;  // of their extent
  return known >= 3 && field_extents({image}, field)[1] < kOnALine;
}

Result<Resection> rough_pose(const CameraModel& camera, const std::vector<DetectedTarget>& targets,
                             const TargetField& field) {
  ResectConfig config;
  config.max_residual_px = 0.02 * camera.normalizer_px();  // what distortion may move, with nothing known of it
  return resect(camera, targets, field, config);
}

int used_targets(const Resection& resection) {
  int used = 0;
  for (const ResectedTarget& target : resection.targets) used += target.used ? 1 : 0;
  return used;
}

// Enough of the targets to believe it: four fit something by chance.
bool convincing(const Resection& resection) {
  const int used = used_targets(resection);
  return used >= 6 && used >= 0.7 * static_cast<double>(resection.targets.size());
}

// How many targets fit the mirror image of the field; 0 where it is not convincing. A field that is flat but for a few
// targets fits both ways with most of them: the few decide.
int fitting_mirrored(const CameraModel& camera, const std::vector<DetectedTarget>& targets, TargetField field) {
  for (auto& [id, target] : field.targets) target.p_world_mm.x() *= -1.0;
  const auto resection = rough_pose(camera, targets, field);
  return resection && convincing(*resection) ? used_targets(*resection) : 0;
}

// The focal length that the targets fit best, from a thirtieth to thirty times the one stated.
std::optional<double> fitting_focal_length(CameraModel camera, const std::vector<DetectedTarget>& targets,
                                           const TargetField& field) {
  const double stated = camera.focal_length_px;
  std::optional<double> best;
  double least = 0.0;
  for (int k = -20; k <= 20; ++k) {
    camera.focal_length_px = stated * std::pow(2.0, k / 4.0);
    const auto resection = rough_pose(camera, targets, field);
    if (!resection || !convincing(*resection)) continue;
    const double misfit = resection->reprojection_rms_px / used_targets(*resection);
    if (!best || misfit < least) {
      best = camera.focal_length_px;
      least = misfit;
    }
  }
  return best;
}

}  // namespace

Result<CameraPose> calibration_start(const CameraModel& nominal, const std::vector<DetectedTarget>& targets,
                                     const TargetField& field) {
  if (on_one_line(targets, field))
    return invalid_input(
        "the targets it shows stand on one line by the field; check the field's columns, or spread the targets over "
        "the "
        "image and in depth");
  const auto resection = rough_pose(nominal, targets, field);
  constexpr int kMoreThanChance = 2;
  const int fitting = resection ? used_targets(*resection) : 0;
  if (fitting_mirrored(nominal, targets, field) >= fitting + kMoreThanChance)
    return invalid_input(
        "the targets contradict the field, but fit its mirror image: check the signs and the order of the field's axes "
        "(they must be right-handed)");
  if (resection && convincing(*resection)) return resection->pose;
  if (const auto focal = fitting_focal_length(nominal, targets, field);
      focal && std::abs(std::log(*focal / nominal.focal_length_px)) > 0.1)
    return invalid_input(
        "the targets do not fit a focal length of {:.0f} px, as stated, but one of about {:.0f} px ({:.2g} times as "
        "long): check --pixel-pitch-um and --focal-length-mm, and that the image is of this camera",
        nominal.focal_length_px, *focal, *focal / nominal.focal_length_px);
  if (resection) return resection->pose;  // few targets, or many wrong ids: the adjustment judges
  return pass_on(resection.error());
}

}  // namespace imprint
