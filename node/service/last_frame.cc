#include "node/service/last_frame.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "lib/clock/wall_clock.h"

namespace imprint {
namespace {

constexpr int kDefaultBytes = 3600;  // with the line before it below 4 kB
constexpr int kMinBytes = 500;
constexpr int kMaxBytes = 65'536;
constexpr int kMaxSide_px = 640;  // more than that no 4 kB can show
constexpr int kMinSide_px = 16;
constexpr double kTargetSides = 5.0;  // of a target's dot: its code ring and a margin
constexpr int kRimsMargin_px = 20;

std::optional<int> whole(std::string_view text) {
  int value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  return read.ec == std::errc() && read.ptr == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

std::optional<cv::Rect> region_of(std::string_view text) {
  int values[4] = {};
  for (int& value : values) {
    const std::string_view part = text.substr(0, text.find(','));
    const auto read = whole(part);
    if (!read) return std::nullopt;
    value = *read;
    text.remove_prefix(std::min(part.size() + 1, text.size()));
  }
  constexpr int kFar = 100'000;
  if (!text.empty() || values[2] <= 0 || values[3] <= 0) return std::nullopt;
  for (const int value : values)
    if (std::abs(value) > kFar) return std::nullopt;
  return cv::Rect(values[0], values[1], values[2], values[3]);
}

std::optional<cv::Rect> rims_of(const ProcessedFrame& found) {
  if (!found.edges) return std::nullopt;
  const Segmentation& frame = found.edges->frame;
  std::vector<cv::Point2f> points;
  for (const auto* rim : {&found.edges->upper, &found.edges->lower}) {
    for (const EdgePoint& point : *rim) {
      const double x_px =
          frame.origin.x_px + point.station_px * frame.direction_x - point.offset_px * frame.direction_y;
      const double y_px =
          frame.origin.y_px + point.station_px * frame.direction_y + point.offset_px * frame.direction_x;
      points.emplace_back(static_cast<float>(x_px), static_cast<float>(y_px));
    }
  }
  if (points.empty()) return std::nullopt;
  const cv::Rect box = cv::boundingRect(points);
  return cv::Rect(box.x - kRimsMargin_px, box.y - kRimsMargin_px, box.width + 2 * kRimsMargin_px,
                  box.height + 2 * kRimsMargin_px);
}

cv::Mat grey8(const cv::Mat& part, bool stretch) {
  double low = 0.0;
  double high = part.depth() == CV_16U ? 65'535.0 : 255.0;
  if (stretch) cv::minMaxLoc(part, &low, &high);
  cv::Mat grey;
  const double scale = 255.0 / std::max(high - low, 1.0);
  part.convertTo(grey, CV_8U, scale, -low * scale);
  return grey;
}

struct Picture {
  std::vector<std::uint8_t> jpeg;
  double scale = 1.0;
};

// The finest that fits: the quality goes down first, then the size.
Result<Picture> fit(const cv::Mat& grey, int max_bytes) {
  double scale = std::min(1.0, static_cast<double>(kMaxSide_px) / std::max(grey.cols, grey.rows));
  Picture picture;
  while (std::max(grey.cols, grey.rows) * scale >= kMinSide_px) {
    cv::Mat small;
    cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
    for (const int quality : {90, 75, 60, 45, 30}) {
      cv::imencode(".jpg", small, picture.jpeg, {cv::IMWRITE_JPEG_QUALITY, quality, cv::IMWRITE_JPEG_OPTIMIZE, 1});
      picture.scale = scale;
      if (picture.jpeg.size() <= static_cast<std::size_t>(max_bytes)) return picture;
    }
    scale *= 0.8;
  }
  return job_failed("crop: no picture of it fits into {} bytes", max_bytes);
}

}  // namespace

void LastFrame::keep(const Frame& frame, const ProcessedFrame& found) {
  Seen seen{
      .image = frame.image, .source = frame.source, .sensor_time_ns = frame.sensor_time_ns, .targets = {}, .rims = {}};
  for (const DetectedTarget& target : found.targets) {
    const int half = static_cast<int>(std::ceil(0.5 * kTargetSides * target.dot_diameter_px));
    const cv::Point middle(static_cast<int>(std::lround(target.center.x_px)),
                           static_cast<int>(std::lround(target.center.y_px)));
    seen.targets.push_back({target.id, cv::Rect(middle.x - half, middle.y - half, 2 * half + 1, 2 * half + 1)});
  }
  seen.rims = rims_of(found);
  const std::lock_guard lock(mutex_);
  seen_ = std::move(seen);
}

void LastFrame::begin(const Frame& frame) {
  const std::lock_guard lock(mutex_);
  if (!seen_) seen_.emplace();
  seen_->image = frame.image, seen_->source = frame.source, seen_->sensor_time_ns = frame.sensor_time_ns;
}

Result<cv::Rect> LastFrame::part_of(const Seen& seen, const Parameters& parameters, std::string& what) {
  if (const auto region = parameters.find("region"); region != parameters.end()) {
    what = "region";
    const auto rectangle = region_of(region->second);
    if (!rectangle) return invalid_input("region: expected x,y,width,height in whole px, found \"{}\"", region->second);
    return *rectangle;
  }
  if (const auto target = parameters.find("target"); target != parameters.end()) {
    what = "target " + target->second;
    const auto id = whole(target->second);
    const auto found = std::ranges::find(seen.targets, id.value_or(-1), &Spot::id);
    if (id && found != seen.targets.end()) return found->around;
    std::string ids;
    for (const Spot& spot : seen.targets) ids += (ids.empty() ? "" : ", ") + std::to_string(spot.id);
    return job_failed("target {}: not seen in the last frame; seen: {}", target->second, ids.empty() ? "none" : ids);
  }
  what = "rims";
  if (seen.rims) return *seen.rims;
  return job_failed("no rims were found in the last frame; look at a region");
}

Result<Bytes> LastFrame::crop(const Parameters& parameters) const {
  std::optional<Seen> seen;
  {
    const std::lock_guard lock(mutex_);
    seen = seen_;  // shares the pixels
  }
  if (!seen || seen->image.empty()) return job_failed("no frame was taken since this node's start");
  std::string what;
  const auto wanted = part_of(*seen, parameters, what);
  if (!wanted) return pass_on(wanted.error());
  const cv::Rect part = *wanted & cv::Rect(0, 0, seen->image.cols, seen->image.rows);
  if (part.empty())
    return invalid_input("{}: outside the frame of {} x {} px", what, seen->image.cols, seen->image.rows);
  const auto bytes = parameters.find("bytes");
  const int max_bytes = bytes == parameters.end() ? kDefaultBytes : whole(bytes->second).value_or(0);
  if (max_bytes < kMinBytes || max_bytes > kMaxBytes)
    return invalid_input("bytes: expected {} to {}, found {}", kMinBytes, kMaxBytes, bytes->second);
  const auto picture = fit(grey8(seen->image(part), parameters.contains("stretch")), max_bytes);
  if (!picture) return pass_on(picture.error());
  const std::string line = nlohmann::json{{"x_px", part.x},          {"y_px", part.y},
                                          {"width_px", part.width},  {"height_px", part.height},
                                          {"scale", picture->scale}, {"what", what},
                                          {"source", seen->source},  {"sensor_time", utc_text(seen->sensor_time_ns)}}
                               .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) +
                           "\n";
  Bytes document(line.begin(), line.end());
  document.insert(document.end(), picture->jpeg.begin(), picture->jpeg.end());
  return document;
}

}  // namespace imprint
