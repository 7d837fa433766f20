#include "node/detect/detect_targets.h"

#include <algorithm>
#include <cmath>

#include "node/detect/decode_ring.h"
#include "node/detect/detect_config.h"
#include "node/detect/detection_trace.h"
#include "node/detect/find_blobs.h"
#include "node/detect/fit_dot.h"
#include "node/detect/image_pyramid.h"
#include "node/detect/scan_ring.h"
#include "node/detect/star_ellipse.h"

namespace imprint {
namespace {

/// The smallest ellipse that the finest level answers for; each level doubles it.
int levels_for(double max_dot_px) {
  int levels = 1;
  while (2.0 * max_level_semi_minor_px * ImagePyramid::scale(levels - 1) < max_dot_px) ++levels;
  return levels;
}

/// A target with what decides between two that claim the same id or place.
struct Found {
  DetectedTarget target;
  Ellipse ellipse;
  double margin = 0.0;
  double fit = 0.0;
};

class TargetSearch {
 public:
  TargetSearch(const cv::Mat& image, const TargetLibrary& library, const DetectConfig& config, DetectionTrace* trace)
      : pyramid_(image, levels_for(config.max_dot_px)),
        library_(library),
        decoder_(library, config.max_unknown),
        config_(config),
        trace_(trace) {}

  std::vector<DetectedTarget> run() {
    // Large dots first: fewer candidates, and the parts of their rings are then known.
    for (int l = pyramid_.levels() - 1; l >= 0; --l) search_level(l);
    return each_id_once();
  }

 private:
  void search_level(int l) {
    const GreyImage& level = pyramid_.level(l);
    for (const cv::Point& blob : find_blobs(level.mat(), config_.min_contrast, config_.max_candidates_per_tile)) {
      const auto star = find_star_ellipse(level, {blob.x, blob.y}, config_);
      if (!star) continue;
      StarEllipse full = *star;
      full.ellipse = star->ellipse.scaled(ImagePyramid::scale(l), ImagePyramid::from_level(star->ellipse.center, l));
      const EllipseAxes axes = axes_of(full.ellipse);
      const double diameter = axes.semi_major_px + axes.semi_minor_px;
      if (diameter < 0.8 * config_.min_dot_px || diameter > 1.25 * config_.max_dot_px) continue;
      if (is_known(full.ellipse)) continue;
      if (const Rejection rejection = examine(level, star->ellipse, full);
          rejection != Rejection::none && trace_ != nullptr) {
        trace_->rejected.push_back({full.ellipse, rejection});
      }
    }
  }

  /// From a rough ellipse to a decoded target, the cheapest doubt first.
  Rejection examine(const GreyImage& level, const Ellipse& on_level, const StarEllipse& star) {
    const RingGlance glance = glance_at_ring(level, on_level, star.white, star.black, library_.geometry);
    if (glance.dark_valley < 0.75) return Rejection::no_dark_ground;
    // A blurred or shaded ring shows fewer white places than it has: half of the fewest is asked for.
    if (glance.white_ring < 0.5 * decoder_.least_white() / library_.bits) return Rejection::no_ring;
    const auto dot = fit_dot(pyramid_.level(0), star.ellipse, star.white, star.black);
    if (!dot || dot->contrast < config_.min_contrast) return Rejection::poor_ellipse;
    const EllipseAxes axes = axes_of(dot->ellipse);
    const double diameter = axes.semi_major_px + axes.semi_minor_px;
    if (diameter < config_.min_dot_px || diameter > config_.max_dot_px) return Rejection::size;
    if (axes.semi_major_px > config_.max_axis_ratio * axes.semi_minor_px) return Rejection::poor_ellipse;
    const auto scan = scan_ring(pyramid_, *dot, library_.bits, library_.geometry, config_.max_unknown);
    if (!scan) return Rejection::outside;
    const DecodedRing ring = decoder_.decode(*scan);
    if (trace_ != nullptr) trace_->decoded.push_back({dot->ellipse, *scan, ring});
    if (!ring.accepted) return Rejection::no_code;
    Found found;
    found.target = {
        ring.id, {dot->ellipse.center.x(), dot->ellipse.center.y()}, dot->sigma_px, diameter, ring.distance};
    found.ellipse = dot->ellipse;
    found.margin = ring.margin;
    found.fit = ring.fit;
    found_.push_back(found);
    return Rejection::none;
  }

  [[nodiscard]] bool is_known(const Ellipse& ellipse) const {
    return std::any_of(found_.begin(), found_.end(),
                       [&](const Found& f) { return f.ellipse.radius_of(ellipse.center) < 0.7; });
  }

  static bool is_better(const Found& a, const Found& b) {
    if (a.target.distance != b.target.distance) return a.target.distance < b.target.distance;
    return a.fit < b.fit;
  }

  /// Of two targets that claim one id the one with fewer bits amiss stays; when neither is better, both go: a wrong id
  /// costs more than a missing one.
  std::vector<DetectedTarget> each_id_once() {
    std::sort(found_.begin(), found_.end(), [](const Found& a, const Found& b) {
      return a.target.id != b.target.id ? a.target.id < b.target.id : is_better(a, b);
    });
    std::vector<DetectedTarget> targets;
    for (auto first = found_.begin(); first != found_.end();) {
      const auto next =
          std::find_if(first, found_.end(), [&](const Found& f) { return f.target.id != first->target.id; });
      const bool alone = next - first == 1;
      const bool clear = alone || first->target.distance + 0.5 <= (first + 1)->target.distance;
      if (clear) targets.push_back(first->target);
      if (trace_ != nullptr) {
        for (auto f = clear ? first + 1 : first; f != next; ++f)
          trace_->rejected.push_back({f->ellipse, Rejection::id_twice});
      }
      first = next;
    }
    return targets;
  }

  ImagePyramid pyramid_;
  const TargetLibrary& library_;
  RingDecoder decoder_;
  const DetectConfig& config_;
  DetectionTrace* trace_;
  std::vector<Found> found_;
};

}  // namespace

std::vector<DetectedTarget> detect_targets(const cv::Mat& image, const TargetLibrary& library,
                                           const DetectConfig& config) {
  return detect_targets(image, library, config, nullptr);
}

std::vector<DetectedTarget> detect_targets(const cv::Mat& image, const TargetLibrary& library,
                                           const DetectConfig& config, DetectionTrace* trace) {
  constexpr int smallest_side_px = 8;
  if (image.empty() || std::min(image.cols, image.rows) < smallest_side_px || library.codes.empty()) return {};
  return TargetSearch(image, library, config, trace).run();
}

}  // namespace imprint
