#include "node/service/last_frame.h"

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

// A frame whose grey levels tell where a pixel is, with noise that no JPEG likes.
cv::Mat busy_frame(int type) {
  cv::Mat image(1200, 1600, type);
  cv::randu(image, 0, type == CV_16U ? 65'535 : 255);
  return image;
}

void show(LastFrame& last, const cv::Mat& image) {
  ProcessedFrame found;
  DetectedTarget target;
  target.id = 7;
  target.center = {400.0, 300.0};
  target.dot_diameter_px = 20.0;
  found.targets.push_back(target);
  Silhouette edges;
  edges.frame.origin = {100.0, 600.0};
  for (int station = 0; station < 1000; station += 10) {
    EdgePoint point;
    point.station_px = station;
    point.offset_px = -150.0;
    edges.upper.push_back(point);
    point.offset_px = 150.0;
    edges.lower.push_back(point);
  }
  found.edges = edges;
  Frame frame;
  frame.image = image;
  frame.source = "test";
  frame.sensor_time_ns = 1;
  last.keep(frame, found);
}

struct Cut {
  nlohmann::json about;
  cv::Mat picture;
  std::size_t bytes = 0;
};

Cut cut(const LastFrame& last, const Parameters& parameters) {
  const auto document = last.crop(parameters);
  REQUIRE(document);
  const auto end = std::find(document->begin(), document->end(), '\n');
  const Bytes jpeg(end + 1, document->end());
  return {nlohmann::json::parse(document->begin(), end), cv::imdecode(jpeg, cv::IMREAD_GRAYSCALE), document->size()};
}

}  // namespace

TEST_CASE("crop: a target, the rims, a region: each fits into 4 kB, whatever is in it") {
  for (const int type : {CV_8U, CV_16U}) {
    LastFrame last;
    show(last, busy_frame(type));
    for (const Parameters& parameters :
         {Parameters{{"target", "7"}}, Parameters{}, Parameters{{"region", "0,0,1600,1200"}}}) {
      const Cut seen = cut(last, parameters);
      REQUIRE(seen.bytes <= 4096);
      REQUIRE_FALSE(seen.picture.empty());
    }
  }
}

TEST_CASE("crop: it shows what it says it shows") {
  LastFrame last;
  cv::Mat image = cv::Mat::zeros(1200, 1600, CV_8U);
  image(cv::Rect(380, 280, 41, 41)).setTo(200);  // around target 7
  show(last, image);
  const Cut target = cut(last, {{"target", "7"}});
  REQUIRE(target.about["x_px"] == 350);
  REQUIRE(target.about["width_px"] == 101);
  REQUIRE(target.picture.size() == cv::Size(101, 101));
  REQUIRE(target.picture.at<std::uint8_t>(50, 50) == Approx(200).margin(3));  // JPEG
  REQUIRE(target.picture.at<std::uint8_t>(5, 5) == Approx(0).margin(3));
  const Cut rims = cut(last, {});
  REQUIRE(rims.about["what"] == "rims");
  REQUIRE(rims.about["y_px"] == 430);  // 600 - 150 - 20
  const Cut corner = cut(last, {{"region", "-50,-50,100,100"}});
  REQUIRE(corner.about["width_px"] == 50);
}

TEST_CASE("crop: a frame still being worked on is shown where the last one had its targets and rims") {
  LastFrame last;
  show(last, cv::Mat::zeros(1200, 1600, CV_8U));
  Frame next;
  next.image = cv::Mat(1200, 1600, CV_8U, cv::Scalar(90));
  next.source = "next";
  last.begin(next);
  for (const Parameters& parameters : {Parameters{{"target", "7"}}, Parameters{}}) {
    const Cut seen = cut(last, parameters);
    CHECK(seen.about["source"] == "next");
    CHECK(seen.picture.at<std::uint8_t>(50, 50) == Approx(90).margin(3));
  }
}

TEST_CASE("crop: stretched, a dark part can be seen") {
  LastFrame last;
  cv::Mat image = cv::Mat::zeros(1200, 1600, CV_16U);
  image(cv::Rect(20, 20, 20, 20)).setTo(300);
  show(last, image);
  const Parameters dark{{"region", "0,0,60,60"}};
  REQUIRE(cut(last, dark).picture.at<std::uint8_t>(30, 30) <= 3);
  Parameters stretched = dark;
  stretched["stretch"] = "1";
  REQUIRE(cut(last, stretched).picture.at<std::uint8_t>(30, 30) >= 250);
}

TEST_CASE("crop: no frame yet, no such target, a region that is none or outside are errors that say so") {
  LastFrame last;
  REQUIRE_FALSE(last.crop({}));
  show(last, busy_frame(CV_8U));
  const auto absent = last.crop({{"target", "8"}});
  REQUIRE_FALSE(absent);
  REQUIRE(absent.error().message.find("seen: 7") != std::string::npos);
  for (const char* region : {"", "1", "1,2,3", "1,2,3,4,5", "a,b,c,d", "0,0,0,5", "0,0,-1,5", "5000,0,10,10",
                             "0,0,2147483647,2147483647", "2147483647,0,1,1", "1,2,3,"})
    REQUIRE_FALSE(last.crop({{"region", region}}));
  for (const char* bytes : {"0", "499", "x", "99999999"}) REQUIRE_FALSE(last.crop({{"bytes", bytes}}));
}

}  // namespace imprint
