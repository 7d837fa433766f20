#include "node/segment/other_bodies.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace imprint {
namespace {

// The forging's own outline with a margin, to be left out.
std::vector<cv::Point> outline_of(const BodyPath& path, double margin_px) {
  std::vector<cv::Point> outline;
  const auto add = [&](double x, double y) {
    outline.emplace_back(static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)));
  };
  const auto &first = path.columns.front(), &last = path.columns.back();
  add(first.x_px - margin_px, first.pair.upper_px - margin_px);
  for (const auto& c : path.columns) add(c.x_px, c.pair.upper_px - margin_px);
  add(last.x_px + margin_px, last.pair.upper_px - margin_px);
  add(last.x_px + margin_px, last.pair.lower_px + margin_px);
  for (auto c = path.columns.rbegin(); c != path.columns.rend(); ++c) add(c->x_px, c->pair.lower_px + margin_px);
  add(first.x_px - margin_px, first.pair.lower_px + margin_px);
  return outline;
}

std::string reason(double length_px, double width_px, double turned_deg, const SegmentPrior& prior,
                   const SegmentConfig& config) {
  const double low = prior.likely_min_px > 0 ? prior.likely_min_px : prior.diameter_min_px;
  const double high = prior.likely_max_px > 0 ? prior.likely_max_px : prior.diameter_max_px;
  if (width_px > high) return fmt::format("wider than the rig's forging ({:.0f} px at most)", high);
  if (width_px < low) return fmt::format("narrower than the rig's forging ({:.0f} px at least)", low);
  if (length_px < config.min_elongation * width_px) return "too short for a forging";
  if (turned_deg > config.max_tilt_deg) return fmt::format("turned {:.0f} deg against the rig's axis", turned_deg);
  return "farther from the middle of the image, or less sure, than the one that was taken";
}

}  // namespace

std::vector<SeenBody> find_other_bodies(const WorkingImage& working, const FoundBody& body, const SegmentPrior& prior,
                                        const SegmentConfig& config) {
  constexpr double kMargin = 0.15, kLeastArea = 0.5, kLeastSide = 0.25, kSolid = 0.6;  // of the width, its square...
  constexpr std::size_t kMost = 5;
  const double width = body.whole.median_width_px();
  cv::Mat_<unsigned char> bright = working.intensity > body.proof.level - 0.5 * body.proof.contrast;
  bright &= working.valid;
  cv::fillPoly(bright, std::vector<std::vector<cv::Point>>{outline_of(body.whole, kMargin * width)}, cv::Scalar(0));
  cv::morphologyEx(bright, bright, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(bright, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
  std::sort(contours.begin(), contours.end(),
            [](const auto& a, const auto& b) { return cv::contourArea(a) > cv::contourArea(b); });
  std::vector<SeenBody> others;
  const double r = working.reduction;
  for (const auto& contour : contours) {
    const double area = cv::contourArea(contour);
    if (others.size() == kMost || area < kLeastArea * width * width) break;
    const cv::RotatedRect box = cv::minAreaRect(contour);
    const double length = std::max(box.size.width, box.size.height), across = std::min(box.size.width, box.size.height);
    if (across < kLeastSide * width || area < kSolid * length * across) continue;
    SeenBody other;
    other.middle = working.observed(box.center.x, box.center.y);
    other.length_px = length * r, other.width_px = across * r;
    const double along = box.size.width >= box.size.height ? box.angle : box.angle + 90.0;
    const ObservedPoint a = working.observed(0, 0), b = working.observed(1, 0);
    const double turned =
        along + (std::atan2(b.y_px - a.y_px, b.x_px - a.x_px) - std::atan2(prior.direction_y, prior.direction_x)) *
                    180.0 / CV_PI;
    other.why_not = reason(other.length_px, other.width_px, std::abs(std::remainder(turned, 180.0)), prior, config);
    others.push_back(std::move(other));
  }
  return others;
}

}  // namespace imprint
