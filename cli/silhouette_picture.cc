#include "cli/silhouette_picture.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "cli/brightened.h"
#include "node/edge/silhouette_frame.h"

namespace imprint {
namespace {

constexpr int kShift = 4;  // drawing in 1/16 px
const cv::Scalar kUntrusted{150, 150, 150}, kRejected{255, 60, 255}, kAxis{255, 110, 30}, kEnd{255, 255, 0};

cv::Scalar color_of(double weight) { return {0, 255 * weight, 255 * (1.0 - weight)}; }

/// How many points of each kind were drawn.
struct Counts {
  int trusted = 0, untrusted = 0, rejected = 0;
};

class Picture {
 public:
  Picture(const cv::Mat& image, const Segmentation& segmentation) : canvas_(brightened(image)), frame_(segmentation) {}

  void dot(double station_px, double offset_px, const cv::Scalar& color, double radius_px) {
    cv::circle(canvas_, place(station_px, offset_px), cvRound(radius_px * (1 << kShift)), color, cv::FILLED,
               cv::LINE_AA, kShift);
  }

  void rim(const std::vector<FilteredPoint>& rim, const std::vector<EdgePoint>& edges) {
    constexpr int kDotEvery = 6;
    std::unordered_set<int> trusted;
    for (const FilteredPoint& point : rim) {
      const int station = static_cast<int>(std::lround(point.station_px));
      if (point.weight > 0) {
        trusted.insert(station);
        dot(point.station_px, point.offset_px, color_of(point.weight), 1.0);
        ++counts_.trusted;
      } else if (++counts_.untrusted; station % kDotEvery == 0) {
        dot(point.station_px, point.offset_px, kUntrusted, 1.0);
      }
    }
    for (const EdgePoint& edge : edges) {
      if (trusted.contains(edge.station_px)) continue;
      dot(edge.station_px, edge.offset_px, kRejected, 0.7);
      ++counts_.rejected;
    }
  }

  void axis(const std::vector<FilteredPoint>& axis) {
    for (const FilteredPoint& point : axis)
      dot(point.station_px, point.offset_px, point.weight > 0 ? kAxis : kUntrusted, point.weight > 0 ? 1.0 : 0.4);
  }

  void end(const LocatedEnd& end) {
    if (!end.visible) return;
    constexpr double kArmPx = 20;
    line(end.station_px, end.offset_px - kArmPx, end.station_px, end.offset_px + kArmPx);
    line(end.station_px - 2 * end.sigma_px, end.offset_px, end.station_px + 2 * end.sigma_px, end.offset_px);
  }

  cv::Mat with_legend(const std::string& title) {
    const double scale = std::max(0.4, canvas_.cols / 2000.0);
    const int line_px = cvRound(26 * scale), thickness = std::max(1, cvRound(scale));
    std::vector<std::pair<std::string, cv::Scalar>> lines{
        {title, {255, 255, 255}},
        {fmt::format("rims, weight 1: {} trusted points", counts_.trusted), color_of(1.0)},
        {"rims, weight 0.2", color_of(0.2)},
        {fmt::format("not trusted, bridged: {}", counts_.untrusted), kUntrusted},
        {fmt::format("edges found there and rejected: {}", counts_.rejected), kRejected},
        {"axis", kAxis},
        {"end, bar of 2 standard deviations", kEnd}};
    cv::Mat picture(canvas_.rows + line_px * static_cast<int>(lines.size() + 1), canvas_.cols, CV_8UC3,
                    cv::Scalar(0, 0, 0));
    canvas_.copyTo(picture.rowRange(0, canvas_.rows));
    int y = canvas_.rows + line_px;
    for (const auto& [text, color] : lines) {
      cv::putText(picture, text, {line_px, y}, cv::FONT_HERSHEY_SIMPLEX, 0.7 * scale, color, thickness, cv::LINE_AA);
      y += line_px;
    }
    return picture;
  }

 private:
  [[nodiscard]] cv::Point place(double station_px, double offset_px) const {
    const ObservedPoint p = frame_.at(station_px, offset_px);
    return {cvRound(p.x_px * (1 << kShift)), cvRound(p.y_px * (1 << kShift))};
  }
  void line(double from_station, double from_offset, double to_station, double to_offset) {
    cv::line(canvas_, place(from_station, from_offset), place(to_station, to_offset), kEnd, 2, cv::LINE_AA, kShift);
  }

  cv::Mat canvas_;
  SilhouetteFrame frame_;
  Counts counts_;
};

}  // namespace

cv::Mat draw_silhouette_picture(const cv::Mat& image, const ProcessedFrame& frame) {
  Picture picture(image, frame.edges ? frame.edges->frame : Segmentation{});
  if (frame.edges) {
    const bool filtered = frame.silhouette.has_value();
    picture.rim(filtered ? frame.silhouette->upper : std::vector<FilteredPoint>{}, frame.edges->upper);
    picture.rim(filtered ? frame.silhouette->lower : std::vector<FilteredPoint>{}, frame.edges->lower);
    if (filtered) picture.axis(frame.silhouette->axis);
    picture.end(frame.edges->start), picture.end(frame.edges->end);
  }
  return picture.with_legend(frame.imprint.failure.empty()
                                 ? fmt::format("camera {}, method {}", frame.imprint.camera_id, frame.imprint.method)
                                 : frame.imprint.failure);
}

}  // namespace imprint
