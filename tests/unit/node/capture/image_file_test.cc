#include "node/capture/image_file.h"

#include <unistd.h>

#include <fstream>

#include <catch2/catch.hpp>
#include <opencv2/imgcodecs.hpp>

#include "lib/config/atomic_file.h"

using namespace imprint;
namespace fs = std::filesystem;

namespace {

/// A folder of this process, removed at the end.
struct Folder {
  fs::path path = fs::temp_directory_path() / fmt::format("imprint_image_file_test_{}", getpid());
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
};

cv::Mat ramp(int type) {
  cv::Mat image(40, 61, type);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      if (type == CV_8U) image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(3 * x + y);
      if (type == CV_16U) image.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(1000 * x + 7 * y);
      if (type == CV_8UC3) image.at<cv::Vec3b>(y, x) = cv::Vec3b(1, 2, static_cast<std::uint8_t>(x + y));
    }
  }
  return image;
}

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string message_of(const fs::path& path) {
  const auto frame = read_image(path, nullptr);
  REQUIRE_FALSE(frame);
  CHECK(frame.error().exit_status() == 2);
  CHECK(frame.error().message.find(path.string()) != std::string::npos);
  CHECK(frame.error().message.find('\n') == std::string::npos);
  return frame.error().message;
}

}  // namespace

TEST_CASE("image file: 8 and 16 bit PNG and TIFF come back pixel for pixel, without a warning") {
  const Folder folder;
  for (const int type : {CV_8U, CV_16U}) {
    for (const char* name : {"a.png", "a.tif"}) {
      const cv::Mat image = ramp(type);
      cv::imwrite((folder.path / name).string(), image);
      std::vector<std::string> warnings;
      const auto frame = read_image(folder.path / name, &warnings);
      REQUIRE(frame);
      CHECK(frame->image.type() == type);
      CHECK(cv::norm(frame->image, image, cv::NORM_INF) == 0.0);
      CHECK(frame->source == (folder.path / name).string());
      CHECK(warnings.empty());
    }
  }
}

TEST_CASE("image file: a colour image is reduced to its red channel with a warning that names it") {
  const Folder folder;
  for (const char* name : {"c.png", "c.tif"}) {
    cv::imwrite((folder.path / name).string(), ramp(CV_8UC3));
    std::vector<std::string> warnings;
    const auto frame = read_image(folder.path / name, &warnings);
    REQUIRE(frame);
    REQUIRE(frame->image.type() == CV_8U);
    CHECK(frame->image.at<std::uint8_t>(5, 7) == 12);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find(name) != std::string::npos);
  }
}

TEST_CASE("image file: missing, empty, foreign and folder paths are errors that name the file") {
  const Folder folder;
  message_of(folder.path / "none.png");
  message_of(folder.path);
  write(folder.path / "empty.png", "");
  CHECK(message_of(folder.path / "empty.png").find("empty") != std::string::npos);
  write(folder.path / "text.png", "these are no pixels");
  message_of(folder.path / "text.png");
}

TEST_CASE("image file: an image cut off at any length is an error, never half a picture") {
  const Folder folder;
  for (const char* name : {"a.png", "a.tif"}) {
    cv::imwrite((folder.path / name).string(), ramp(CV_16U));
    const std::string whole = bytes_of(folder.path / name);
    const fs::path cut = folder.path / ("cut" + fs::path(name).extension().string());
    for (std::size_t size = 1; size + 1 < whole.size(); size += 1 + whole.size() / 97) {
      INFO(name << " cut to " << size << " of " << whole.size() << " bytes");
      write(cut, whole.substr(0, size));
      message_of(cut);
    }
  }
}

TEST_CASE("image file: damaged bytes never crash the reader") {
  const Folder folder;
  for (const char* name : {"a.png", "a.tif"}) {
    cv::imwrite((folder.path / name).string(), ramp(CV_8U));
    const std::string whole = bytes_of(folder.path / name);
    for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 200) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(~damaged[at]);
      write(folder.path / name, damaged);
      const auto frame = read_image(folder.path / name, nullptr);
      if (frame) CHECK((frame->image.depth() == CV_8U || frame->image.depth() == CV_16U));
    }
  }
}

TEST_CASE("image file: a header that promises size zero or an absurd size is refused before decoding") {
  const Folder folder;
  cv::imwrite((folder.path / "a.png").string(), ramp(CV_8U));
  std::string huge = bytes_of(folder.path / "a.png");
  for (std::size_t i = 16; i < 24; ++i) huge[i] = '\x3f';
  write(folder.path / "huge.png", huge);
  CHECK(message_of(folder.path / "huge.png").find("pixels") != std::string::npos);
  std::string zero = huge;
  for (std::size_t i = 16; i < 24; ++i) zero[i] = '\0';
  write(folder.path / "zero.png", zero);
  message_of(folder.path / "zero.png");
}

TEST_CASE("image file: pixels of other types are refused") {
  const Folder folder;
  const cv::Mat real(10, 10, CV_32F, cv::Scalar(0.5));
  cv::imwrite((folder.path / "f.tif").string(), real);
  message_of(folder.path / "f.tif");
}
