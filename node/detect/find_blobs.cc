#include "node/detect/find_blobs.h"

#include <algorithm>

#include <opencv2/imgproc.hpp>

namespace imprint {
namespace {

constexpr int tile_px = 256;
constexpr int halo_px = 8;  // further than the widest kernel and the neighbour of a maximum reach

double strength(const cv::Mat& response, const cv::Point& p) {
  switch (response.depth()) {
    case CV_16U:
      return response.at<std::uint16_t>(p);
    case CV_32F:
      return static_cast<double>(response.at<float>(p));
    default:
      return response.at<std::uint8_t>(p);
  }
}

/// Centre minus surround; zero where that is negative, but for floats.
cv::Mat blob_response(const cv::Mat& level, BlobSize size) {
  cv::Mat center;
  cv::Mat surround;
  cv::Mat response;
  if (size == BlobSize::tiny) {
    cv::GaussianBlur(level, center, {3, 3}, 0.6, 0.6, cv::BORDER_REPLICATE);
    cv::GaussianBlur(level, surround, {7, 7}, 1.3, 1.3, cv::BORDER_REPLICATE);
  } else {
    cv::GaussianBlur(level, center, {5, 5}, 1.0, 1.0, cv::BORDER_REPLICATE);
    cv::GaussianBlur(level, surround, {11, 11}, 2.4, 2.4, cv::BORDER_REPLICATE);
  }
  cv::subtract(center, surround, response);
  return response;
}

void keep_strongest(std::vector<cv::Point>& points, std::size_t count, const cv::Mat& response) {
  if (points.size() <= count) return;
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(count), points.end(),
                   [&response](const cv::Point& a, const cv::Point& b) {
                     const double strength_a = strength(response, a);
                     const double strength_b = strength(response, b);
                     if (strength_a != strength_b) return strength_a > strength_b;
                     return a.y != b.y ? a.y < b.y : a.x < b.x;  // the same choice on every machine
                   });
  points.resize(count);
}

}  // namespace

std::vector<cv::Point> find_blobs(const cv::Mat& level, double min_contrast, int per_tile, BlobSize size) {
  std::vector<cv::Point> result;
  // One row of tiles at a time: the whole level's responses would be six more images.
  for (int y = 0; y < level.rows; y += tile_px) {
    const int height = std::min(tile_px, level.rows - y);
    const int top = std::max(0, y - halo_px);
    const cv::Mat response =
        blob_response(level.rowRange(top, std::min(level.rows, y + height + halo_px)).clone(), size);
    cv::Mat highest;
    cv::Mat is_maximum;
    cv::dilate(response, highest, {});
    cv::compare(response, highest, is_maximum, cv::CMP_EQ);
    // A dot's response is 0.35 to 0.55 of its contrast over the sizes that this level answers for.
    cv::bitwise_and(is_maximum, response >= std::max(1.0, 0.3 * min_contrast), is_maximum);
    for (int x = 0; x < level.cols; x += tile_px) {
      const cv::Rect tile(x, y - top, std::min(tile_px, level.cols - x), height);
      std::vector<cv::Point> maxima;
      cv::findNonZero(is_maximum(tile), maxima);
      keep_strongest(maxima, static_cast<std::size_t>(per_tile), response(tile));
      for (const cv::Point& p : maxima) result.push_back(p + cv::Point(x, y));
    }
  }
  return result;
}

}  // namespace imprint
