#include "cli/brightened.h"

#include <algorithm>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace imprint {

cv::Mat brightened(const cv::Mat& image) {
  cv::Mat wide;
  image.convertTo(wide, CV_32F);
  const int step = std::max(1, static_cast<int>(wide.total() / 200000));
  std::vector<float> sample;
  for (std::size_t i = 0; i < wide.total(); i += static_cast<std::size_t>(step))
    sample.push_back(wide.at<float>(static_cast<int>(i) / wide.cols, static_cast<int>(i) % wide.cols));
  std::sort(sample.begin(), sample.end());
  const float darkest = sample[sample.size() * 2 / 1000];
  const float brightest = sample[sample.size() - 1 - sample.size() * 2 / 1000];
  cv::Mat share = cv::max(cv::min((wide - darkest) / std::max(1.0F, brightest - darkest), 1.0), 0.0);
  cv::sqrt(share, share);
  cv::Mat grey;
  share.convertTo(grey, CV_8U, 200.0);  // leaves the brightest for what is drawn
  cv::Mat color;
  cv::cvtColor(grey, color, cv::COLOR_GRAY2BGR);
  return color;
}

}  // namespace imprint
