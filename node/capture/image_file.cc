#include "node/capture/image_file.h"

#include <string_view>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

#include "lib/config/atomic_file.h"
#include "node/capture/image_header.h"

namespace imprint {
namespace {

/// OpenCV's decoders report by exception, by an empty picture, or on stderr: here all become an empty picture.
cv::Mat decode(std::string_view bytes) {
  const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
  // Of unknown TIFF tags and the like; what matters comes back as our own one-line error.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  try {
    return cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
  } catch (const std::exception&) {  // cv::Exception, or bad_alloc for a picture larger than memory
    return {};
  }
}

cv::Mat red_channel(const cv::Mat& bgr) {
  cv::Mat red;
  cv::extractChannel(bgr, red, 2);
  return red;
}

}  // namespace

Result<Frame> read_image(const std::filesystem::path& path, std::vector<std::string>* warnings) {
  const std::string source = path.string();
  std::error_code status;
  if (!std::filesystem::is_regular_file(path, status)) {
    return invalid_input("{}: expected a PNG or TIFF image, found {}", source,
                         std::filesystem::exists(path, status) ? "no regular file" : "no such file");
  }
  constexpr std::uintmax_t max_file_bytes = 2'000'000'000;  // the decoder counts bytes in an int
  if (const auto size = std::filesystem::file_size(path, status); status || size > max_file_bytes) {
    return invalid_input("{}: expected an image file of at most {} bytes, found {}", source, max_file_bytes, size);
  }
  const auto bytes = read_file(path);
  if (!bytes) return pass_on(bytes.error());
  const auto header = check_image_bytes(*bytes, source);
  if (!header) return pass_on(header.error());
  if (header->width_px < 1 || header->height_px < 1 || header->width_px > max_image_pixels / header->height_px) {
    return invalid_input("{}: expected an image of 1 to {} pixels, found {} x {}", source, max_image_pixels,
                         header->width_px, header->height_px);
  }
  cv::Mat image = decode(*bytes);
  if (image.cols != header->width_px || image.rows != header->height_px) {
    return invalid_input(
        "{}: expected an image of {} x {} px as its header says, its pixels cannot be decoded; the file is damaged",
        source, header->width_px, header->height_px);
  }
  if (image.depth() != CV_8U && image.depth() != CV_16U) {
    return invalid_input("{}: expected pixels of 8 or 16 bit, found another type", source);
  }
  if (image.channels() > 1) {
    if (image.channels() < 3)
      return invalid_input("{}: expected one channel or colour, found {} channels", source, image.channels());
    image = red_channel(image);
    if (warnings != nullptr) warnings->push_back(fmt::format("{}: a colour image, reduced to its red channel", source));
  }
  return Frame{image, source, 0, 0, {}};
}

}  // namespace imprint
