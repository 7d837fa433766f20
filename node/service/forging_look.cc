#include "node/service/forging_look.h"

#include "node/detect/detect_config.h"
#include "node/detect/detect_targets.h"
#include "node/resect/resect.h"
#include "node/segment/segment_config.h"
#include "node/segment/segment_prior.h"

namespace imprint {

void ForgingLook::learn(const ProcessedFrame& measured) {
  if (measured.resection) pose_ = measured.resection->pose;
}

std::optional<Segmentation> ForgingLook::see(const Frame& frame) {
  if (frame.image.cols != camera_.width_px || frame.image.rows != camera_.height_px) return std::nullopt;
  if (!pose_) {
    const auto targets = detect_targets(frame.image, rig_.library, DetectConfig{});
    if (const auto own = resect(camera_, targets, rig_.field, ResectConfig{}, rig_.dots)) pose_ = own->pose;
  }
  if (!pose_) return std::nullopt;
  const auto prior = make_segment_prior(camera_, *pose_, rig_.forging, rig_.field);
  if (!prior) return std::nullopt;
  const auto forging = segment_forging(frame.image, *prior, SegmentConfig{});
  return forging ? std::optional(*forging) : std::nullopt;
}

}  // namespace imprint
