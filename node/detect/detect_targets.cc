#include "node/detect/detect_targets.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lib/targets/code_distance.h"
#include "node/detect/decode_ring.h"
#include "node/detect/detect_config.h"
#include "node/detect/detection_trace.h"
#include "node/detect/examined_places.h"
#include "node/detect/find_blobs.h"
#include "node/detect/fit_dot.h"
#include "node/detect/found_targets.h"
#include "node/detect/image_pyramid.h"
#include "node/detect/looks.h"
#include "node/detect/ring_correlator.h"
#include "node/detect/ring_light.h"
#include "node/detect/scan_ring.h"
#include "node/detect/star_ellipse.h"

namespace imprint {
namespace {

/// A centre less sure than this share of the dot's diameter is no dot's: texture that happens to look like one.
constexpr double max_sigma_of_diameter = 0.04;

/// Spots of a texture stand beside each other like a small dot and a ring of few arcs: from a dot of few px only a
/// ring with many changes of colour, all of them right, is taken for a code. The ring's lead, or less: negative when
/// the ring does not tell enough.
double lead_by_size(const DecodedRing& ring, double minor_axis_px, int bits) {
  constexpr double small_px = 5.0;
  constexpr double medium_px = 8.0;
  constexpr double too_little = -1.0;
  const int transitions = bit_transitions(ring.code, bits);
  if (minor_axis_px >= medium_px) return ring.lead;
  if (minor_axis_px >= small_px) return transitions >= 4 ? ring.lead : too_little;
  constexpr double sure_margin = 8.0;  // nats
  constexpr double good_cost = 7.0;    // nats
  if (transitions < 6 || ring.distance > 0.0 || ring.margin < sure_margin || ring.cost > good_cost) return too_little;
  // The smaller a dot, the less of a reading is its own: it fits worse, or is beyond doubt. What is doubtful is
  // believed among other targets only.
  constexpr double good_fit = 0.13;
  constexpr double fit_of_one_px = 0.28;
  constexpr double margin_beyond_doubt = 18.0;  // nats
  constexpr double doubtful_lead = 0.5;         // nats
  const bool good =
      ring.fit < good_fit && (ring.fit * minor_axis_px < fit_of_one_px || ring.margin > margin_beyond_doubt);
  return good ? ring.lead : std::min(ring.lead, doubtful_lead);
}

class TargetSearch {
 public:
  TargetSearch(const cv::Mat& image, const TargetLibrary& library, const DetectConfig& config, DetectionTrace* trace)
      : pyramid_(image, levels_for(config.max_dot_px)),
        library_(library),
        decoder_(library, config.max_unknown),
        correlator_(library),
        config_(config),
        noise_(image_noise(pyramid_.level(0))),
        looks_(choose_looks(pyramid_, noise_, config)),
        trace_(trace) {}

  std::vector<DetectedTarget> run() {
    for (std::size_t i = 0; i < looks_.size(); ++i) collect_candidates(i);
    // The best ellipses first, so that the parts of a target's ring are known when their turn comes.
    std::stable_sort(candidates_.begin(), candidates_.end(),
                     [](const Candidate& a, const Candidate& b) { return a.doubt < b.doubt; });
    for (const Candidate& candidate : candidates_) {
      const Look& look = looks_[candidate.look];
      if (is_known(candidate.full) || examined_.has_like(candidate.full, look.rank())) continue;
      examined_.add(candidate.full, look.rank());
      const Rejection rejection = examine(look, candidate.star);
      if (rejection != Rejection::none) reject(candidate.full, rejection);
    }
    return choose_targets(std::move(found_), unread_, trace_);
  }

 private:
  struct DecodedDot {
    Rejection rejection = Rejection::none;
    RingScan scan;
    DecodedRing ring;
  };
  struct Candidate {
    std::size_t look = 0;
    StarEllipse star;  // px of the look's level
    Ellipse full;      // px of the image
    double doubt = 0.0;
  };

  /// Ellipses of one look that stand on dark ground and have something like a ring.
  void collect_candidates(std::size_t index) {
    const Look& look = looks_[index];
    const double scale = ImagePyramid::scale(look.level);
    // A blurred or shaded ring shows fewer white places than it has: half of the fewest is asked for.
    const double least_white_ring = 0.5 * decoder_.least_white() / library_.bits;
    // What is lost in the noise of a level shows on a coarser one, or not at all.
    constexpr double least_signal_to_noise = 3.5;
    DetectConfig of_level = config_;
    of_level.min_contrast = std::max(config_.min_contrast, least_signal_to_noise * look.noise);
    // Where all dots are tiny, those that are not targets' have to be many to hide one.
    const int per_tile = look.level < 0 ? config_.max_candidates_per_tile / 2 : config_.max_candidates_per_tile;
    const auto blobs = find_blobs(look.grey.mat(), of_level.min_contrast, per_tile, look.blobs);
    for (const cv::Point& blob : blobs) {
      const Eigen::Vector2d start =
          look.level < 0 ? ImagePyramid::to_level({blob.x, blob.y}, look.level) : Eigen::Vector2d(blob.x, blob.y);
      const auto star = find_star_ellipse(look.grey, start, of_level);
      if (!star) continue;
      const Ellipse full = star->ellipse.scaled(scale, ImagePyramid::from_level(star->ellipse.center, look.level));
      const double diameter = mean_diameter(full);
      if (diameter < 0.8 * config_.min_dot_px || diameter > 1.25 * config_.max_dot_px) continue;
      const double least_light = look.is_sharpened() ? 0.2 : 0.35;
      const RingGlance glance =
          glance_at_ring(look.grey, star->ellipse, star->white, star->black, least_light, library_.geometry);
      constexpr double least_dark_valley = 0.75;
      if (glance.dark_valley < least_dark_valley) {
        reject(full, Rejection::no_dark_ground);
      } else if (glance.white_ring < least_white_ring) {
        reject(full, Rejection::no_ring);
      } else {
        candidates_.push_back({index, *star, full, star->residual + (1.0 - glance.dark_valley)});
      }
    }
  }

  void reject(const Ellipse& ellipse, Rejection reason) {
    if (trace_ != nullptr) trace_->rejected.push_back({ellipse, reason});
  }

  /// From a rough ellipse to a decoded target, the cheapest doubt first: the fit at full resolution, which takes the
  /// longest, is left to what has a code already.
  Rejection examine(const Look& look, const StarEllipse& star) {
    const auto rough = fit_dot(look.grey, {star.ellipse, star.black, star.white - star.black});
    if (!rough || rough->contrast < config_.min_contrast) return Rejection::poor_ellipse;
    if (is_poor(*rough, look.noise, flaws_before_ring)) return Rejection::poor_ellipse;
    FittedDot dot = look.is_sharpened() ? from_level(*rough, look.level) : at_full_resolution(*rough, look.level);
    DecodedDot decoded = decode(dot, look);
    if (decoded.rejection == Rejection::no_code) count_unread(decoded.ring);
    if (decoded.rejection != Rejection::none) return decoded.rejection;
    const Rejection rejection = look.is_sharpened() ? fit_blurred(look, dot, decoded) : fit_finely(look, dot, decoded);
    if (rejection != Rejection::none) return rejection;
    const DetectedTarget target{decoded.ring.id,
                                {dot.ellipse.center.x(), dot.ellipse.center.y()},
                                dot.sigma_px,
                                mean_diameter(dot.ellipse),
                                decoded.ring.distance};
    found_.push_back({target, dot.ellipse, decoded.ring.lead, decoded.ring.fit, decoded.ring.covered > 0.0});
    return Rejection::none;
  }

  void count_unread(const DecodedRing& ring) {
    constexpr double most_cost = 18.0;  // nats
    ++unread_.all;
    if (ring.cost > 0.0 && ring.cost < most_cost) ++unread_.like_codes;
  }

  /// Now that the code is known, the ring's light can be taken off; in small dots it reaches the window, and the first
  /// fit, which it disturbed, has to be mended twice.
  Rejection fit_finely(const Look& look, FittedDot& dot, DecodedDot& decoded) {
    constexpr double small_px = 10.0;
    const int rounds = mean_diameter(dot.ellipse) < small_px ? 3 : 1;
    for (int round = 0; round < rounds; ++round) {
      const auto fine = fit_at_full_resolution(dot, shading_prior(decoded),
                                               [&](const Eigen::Vector2d& p) { return ring_light(p, dot, decoded); });
      if (!fine || is_poor(*fine, noise_at(dot), is_tiny(dot) ? flaws_before_ring : flaws))
        return Rejection::poor_ellipse;
      DecodedDot again = decode(*fine, look);
      // In a dot of few px blur and size can be taken for each other: a fit that spoils the reading is not believed.
      constexpr double sure_before = 12.0;  // nats
      if (is_tiny(dot) && decoded.ring.margin > sure_before &&
          (again.rejection != Rejection::none || again.ring.cost > decoded.ring.cost))
        break;
      if (again.rejection != Rejection::none) return again.rejection;
      dot = *fine;
      decoded = std::move(again);
    }
    return Rejection::none;
  }

  /// A dot of few px is not quite what a blurred ellipse is: its pixels are as large as its blur.
  static bool is_tiny(const FittedDot& dot) {
    constexpr double tiny_px = 5.0;
    return 2.0 * axes_of(dot.ellipse).semi_minor_px < tiny_px;
  }

  /// The ring, two to three times as wide, tells the slope of the light better than the dot does.
  static ShadingPrior shading_prior(const DecodedDot& decoded) {
    const auto light = light_on_ring(decoded.scan, decoded.ring.code);
    return light ? ShadingPrior{light->slope, light->slope_sigma} : ShadingPrior{};
  }

  [[nodiscard]] std::optional<FittedDot> fit_at_full_resolution(const FittedDot& dot, const ShadingPrior& shading,
                                                                const LightAt& other_light) const {
    if (!is_tiny(dot)) {
      return fit_dot(pyramid_.level(0), {dot.ellipse, dot.black, dot.contrast, dot.blur_px, shading}, other_light);
    }
    constexpr int doubled = -1;
    const FittedDot in_doubled = to_level(dot, doubled);
    auto fine = fit_dot(GreyImage(pyramid_.level(0).mat(), GreyImage::Size::doubled),
                        {in_doubled.ellipse, dot.black, dot.contrast, in_doubled.blur_px, shading},
                        [&](const Eigen::Vector2d& p) { return other_light(ImagePyramid::from_level(p, doubled)); });
    if (!fine) return std::nullopt;
    fine = from_level(*fine, doubled);
    fine->sigma_px *= 2.0;  // four places to a pixel are still one reading
    return fine;
  }

  /// The shape from the sharpened look, the centre from the image as it is, whose noise is known.
  Rejection fit_blurred(const Look& look, FittedDot& dot, DecodedDot& decoded) {
    constexpr int rounds = 2;
    for (int round = 0; round < rounds; ++round) {  // as long as it mends something
      const FittedDot in_look = to_level(dot, look.level);
      const auto fine = fit_dot(
          look.grey, {in_look.ellipse, in_look.black, in_look.contrast, in_look.blur_px},
          [&](const Eigen::Vector2d& p) { return ring_light(ImagePyramid::from_level(p, look.level), dot, decoded); });
      if (!fine || is_poor(*fine, look.noise, flaws)) break;
      const FittedDot mended = from_level(*fine, look.level);
      DecodedDot again = decode(mended, look);
      if (again.rejection != Rejection::none || again.ring.id != decoded.ring.id) break;
      dot = mended;
      decoded = std::move(again);
    }
    FittedDot blurred = dot;
    blurred.blur_px = std::hypot(dot.blur_px, look.removed_blur_px);
    DecodedDot seen = decoded;
    set_blur(seen.scan, blurred, library_.geometry);
    const auto place = fit_dot(
        pyramid_.level(0), {blurred.ellipse, blurred.black, blurred.contrast, blurred.blur_px},
        [&](const Eigen::Vector2d& p) { return ring_light(p, blurred, seen); }, FitFreedom::place);
    if (!place) return Rejection::poor_ellipse;
    dot = *place;
    return Rejection::none;
  }

  [[nodiscard]] double ring_light(const Eigen::Vector2d& place, const FittedDot& dot, const DecodedDot& decoded) const {
    return ring_light_at(place, dot, decoded.scan, decoded.ring.code, library_.geometry);
  }

  /// A dot of one level in px of the image, without the width of the level's larger pixels.
  static FittedDot at_full_resolution(const FittedDot& rough, int level) {
    FittedDot full = from_level(rough, level);
    const double pixel_variance = 1.0 / 12.0;
    const double level_variance = pixel_variance * ImagePyramid::scale(level) * ImagePyramid::scale(level);
    full.blur_px = std::sqrt(std::max(pixel_variance, full.blur_px * full.blur_px + pixel_variance - level_variance));
    return full;
  }

  /// Standard deviation of the noise about a dot: where it is strong it differs from place to place, since shot noise
  /// follows the light and black and white cut it off. No more than half above the image's, so that texture does not
  /// pass for noise.
  [[nodiscard]] double noise_at(const FittedDot& dot) const {
    constexpr double strong = 0.1;  // share of the contrast
    if (noise_ < strong * dot.contrast) return noise_;
    const double reach =
        library_.geometry.ring_outer_radius / library_.geometry.dot_radius * axes_of(dot.ellipse).semi_major_px;
    const Eigen::Vector2d& center = dot.ellipse.center;
    const cv::Rect2d square(center.x() - reach, center.y() - reach, 2.0 * reach, 2.0 * reach);
    const cv::Mat& image = pyramid_.level(0).mat();
    const cv::Rect inside = cv::Rect(square) & cv::Rect(0, 0, image.cols, image.rows);
    return std::clamp(image_noise(GreyImage(image(inside))), noise_, 1.5 * noise_);
  }

  /// Whether the grey values are farther from a dot's than noise and small flaws make them.
  static constexpr double flaws = 0.12;             // share of the contrast
  static constexpr double flaws_before_ring = 0.2;  // while the ring's light is still in it
  static bool is_poor(const FittedDot& dot, double noise, double allowed_flaws) {
    return dot.residual > std::hypot(allowed_flaws * dot.contrast, 2.0 * noise) ||
           dot.sigma_px > max_sigma_of_diameter * mean_diameter(dot.ellipse);
  }

  /// Whether dot and ring together are farther from a target's than either may be alone.
  [[nodiscard]] bool is_doubtful(const FittedDot& dot, const DecodedRing& ring) const {
    constexpr double limit = 0.155;   // share of the contrast
    constexpr double known_to = 1.3;  // the noise: it is cut off at black and white, and read off few pixels
    const double noise = known_to * noise_at(dot);
    const double of_dot = std::sqrt(std::max(0.0, dot.residual * dot.residual - noise * noise)) / dot.contrast;
    return std::hypot(of_dot, ring.profile) > limit;
  }

  /// The level on which the dot's smaller radius is 5 to 10 px, or 2.5 to 5 of the doubled image.
  [[nodiscard]] int scan_level(double semi_minor_px) const {
    if (semi_minor_px < 2.5) return -1;
    int l = 0;
    while (l + 1 < pyramid_.levels() && semi_minor_px / ImagePyramid::scale(l) > 10.0) ++l;
    return l;
  }

  std::optional<RingScan> scan(const FittedDot& dot, const Look& look,
                               std::optional<int> first_column = std::nullopt) const {
    if (look.is_sharpened()) {
      return scan_ring(look.grey, look.level, dot, library_.bits, library_.geometry,
                       look.noise * ImagePyramid::scale(look.level), config_.max_unknown, first_column);
    }
    const int l = scan_level(axes_of(dot.ellipse).semi_minor_px);
    const GreyImage image = l < 0 ? GreyImage(pyramid_.level(0).mat(), GreyImage::Size::doubled) : pyramid_.level(l);
    return scan_ring(image, l, dot, library_.bits, library_.geometry, noise_at(dot), config_.max_unknown);
  }

  DecodedDot decode(const FittedDot& dot, const Look& look) {
    const double diameter = mean_diameter(dot.ellipse);
    if (diameter < config_.min_dot_px || diameter > config_.max_dot_px) return {Rejection::size, {}, {}};
    const EllipseAxes axes = axes_of(dot.ellipse);
    if (axes.semi_major_px > config_.max_axis_ratio * axes.semi_minor_px) return {Rejection::poor_ellipse, {}, {}};
    auto scanned = scan(dot, look);
    if (!scanned) return {Rejection::outside, {}, {}};
    const bool plain = config_.decoder == Decoder::plain;
    DecodedRing ring;
    if (plain) {
      ring = decoder_.decode_plainly(*scanned);
    } else if (!look.is_sharpened()) {
      ring = decoder_.decode(*scanned);
    } else {
      const RingCorrelator::Correlated correlated = correlator_.correlate(*scanned);
      ring = correlated.ring;
      scanned = scan(dot, look, scanned->first_column + correlated.turn);
      if (!scanned) return {Rejection::outside, {}, {}};
      const double response = scanned->response.front().own;
      set_light(*scanned, Eigen::Vector2d::Zero(), correlated.light / std::max(0.1, response));
      ring.accepted = ring.accepted && !is_open(*scanned, ring.code);
    }
    if (trace_ != nullptr) trace_->decoded.push_back({dot, *scanned, ring});
    if (!plain) ring.lead = lead_by_size(ring, 2.0 * axes.semi_minor_px, library_.bits);
    const bool accepted = ring.accepted && (plain || (!is_doubtful(dot, ring) && ring.lead > 0.0));
    return {accepted ? Rejection::none : Rejection::no_code, std::move(*scanned), ring};
  }

  /// Whether the place belongs to a target that is found: its dot or its ring.
  [[nodiscard]] bool is_known(const Ellipse& ellipse) const {
    const double outer = library_.geometry.ring_outer_radius / library_.geometry.dot_radius;
    return std::any_of(found_.begin(), found_.end(),
                       [&](const FoundTarget& f) { return f.ellipse.radius_of(ellipse.center) < outer; });
  }

  ImagePyramid pyramid_;
  std::vector<Candidate> candidates_;
  ExaminedPlaces examined_;
  const TargetLibrary& library_;
  RingDecoder decoder_;
  RingCorrelator correlator_;
  const DetectConfig& config_;
  double noise_;
  std::vector<Look> looks_;
  DetectionTrace* trace_;
  std::vector<FoundTarget> found_;
  UnreadRings unread_;
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
