#include "node/node_pipeline.h"

#include <filesystem>

#include <unistd.h>

#include <catch2/catch.hpp>
#include <opencv2/imgproc.hpp>

#include "lib/rig/rig.h"
#include "node/capture/image_file.h"
#include "simulation/scene.h"
#include "simulation/simulation.h"

using namespace imprint;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

// One rendered frame of the small laboratory, and what is made of it: its hall without a forging, its targets covered.
class RenderedLine {
 public:
  RenderedLine() {
    auto scene = read_scene(fs::path(IMPRINT_TEST_DATA) / "small_laboratory.toml");
    REQUIRE(scene);
    scene->observations.rotations_deg = {0.0};
    scene->cameras.resize(2);  // the second only so that the rig is one
    scene->backdrop.clutter = 0.0;
    const fs::path folder = fs::temp_directory_path() / ("node_pipeline_test_" + std::to_string(::getpid()));
    const auto written = write_simulation(
        *scene, folder, [](std::string_view, double) {}, 2);
    REQUIRE(written);
    const auto read = read_rig(folder / "rig.toml");
    REQUIRE(read);
    rig_ = *read;
    const auto frame = read_image(folder / "obs00_cam1.png", nullptr);
    REQUIRE(frame);
    hot_ = frame->image;
    fs::remove_all(folder);
    measured_ = process_frame(as_frame(hot_, kSecond), camera(), rig_, EdgeMethod::best);
    REQUIRE(measured_.imprint.failure.empty());
    REQUIRE(measured_.silhouette);
  }

  [[nodiscard]] const CameraModel& camera() const { return rig_.cameras.front(); }
  [[nodiscard]] const ProcessedFrame& measured() const { return measured_; }
  [[nodiscard]] const cv::Mat& hot() const { return hot_; }

  // The wall where the forging was, with noise of its own.
  [[nodiscard]] cv::Mat empty_hall(int seed) const {
    const double inf = 1e9;
    double left = inf, right = -inf, top = inf, bottom = -inf;
    for (const auto* rim : {&measured_.silhouette->upper, &measured_.silhouette->lower}) {
      for (const FilteredPoint& point : *rim) {
        const Segmentation& frame = measured_.silhouette->frame;
        const double x = frame.origin.x_px + point.station_px * frame.direction_x - point.offset_px * frame.direction_y;
        const double y = frame.origin.y_px + point.station_px * frame.direction_y + point.offset_px * frame.direction_x;
        left = std::min(left, x), right = std::max(right, x);
        top = std::min(top, y), bottom = std::max(bottom, y);
      }
    }
    cv::Mat image = hot_.clone();
    const cv::Rect all(0, 0, image.cols, image.rows);
    const cv::Rect forging = cv::Rect(cv::Point(static_cast<int>(left) - 25, static_cast<int>(top) - 12),
                                      cv::Point(static_cast<int>(right) + 25, static_cast<int>(bottom) + 12)) &
                             all;
    image(forging).setTo(204);
    cv::Mat noise(image.size(), CV_16S);
    cv::RNG random(static_cast<std::uint64_t>(seed));
    random.fill(noise, cv::RNG::NORMAL, 0, 1.5);
    cv::add(image, noise, image, cv::noArray(), image.type());
    return image;
  }

  [[nodiscard]] cv::Mat without_targets() const {
    cv::Mat image = hot_.clone();
    for (const DetectedTarget& target : measured_.targets)
      cv::circle(image, cv::Point(static_cast<int>(target.center.x_px), static_cast<int>(target.center.y_px)),
                 static_cast<int>(0.6 * target.dot_diameter_px), cv::Scalar(10), cv::FILLED);
    return image;
  }

  // What a turn of the camera by 4 px of its image shows.
  [[nodiscard]] cv::Mat knocked() const {
    cv::Mat image;
    cv::warpAffine(hot_, image, cv::Mat(cv::Matx23d(1, 0, 4, 0, 1, 0)), hot_.size(), cv::INTER_NEAREST,
                   cv::BORDER_REPLICATE);
    return image;
  }

  [[nodiscard]] Imprint process(const cv::Mat& image, PoseKeeper* keeper, int second) const {
    return process_frame(as_frame(image, second * kSecond), camera(), rig_, EdgeMethod::best, keeper).imprint;
  }

 private:
  static Frame as_frame(const cv::Mat& image, std::int64_t time_ns) { return {image, "frame", time_ns, 0, {}}; }

  Rig rig_;
  cv::Mat hot_;
  ProcessedFrame measured_;
};

const RenderedLine& line() {
  static const RenderedLine rendered;
  return rendered;
}

}  // namespace

TEST_CASE("node pipeline: frames that all show a forging are measured as without a pose keeper, to the last bit") {
  PoseKeeper keeper;
  for (int second = 1; second <= 2; ++second) {
    const Imprint imprint = line().process(line().hot(), &keeper, second);
    CHECK(imprint.failure.empty());
    CHECK(imprint.pose.center_world_mm == line().measured().imprint.pose.center_world_mm);
    CHECK(imprint.upper.offset_px == line().measured().imprint.upper.offset_px);
    CHECK(imprint.pose_state == PoseState::tracking);
  }
}

TEST_CASE("node pipeline: empty frames give the pose that is held when the forging comes; a knock is flagged") {
  PoseKeeper keeper;
  int second = 0;
  while (second < 4) {
    ++second;
    const Imprint empty = line().process(line().empty_hall(second), &keeper, second);
    CHECK_THAT(empty.failure, Contains("cam1"));  // there is no forging to measure
    CHECK(empty.quality.targets_used >= 8);
  }
  REQUIRE(keeper.kept());

  const Imprint held = line().process(line().hot(), &keeper, ++second);
  CHECK(held.failure.empty());
  CHECK(held.pose_state == PoseState::hold);
  CHECK_FALSE(held.pose_doubtful);
  CHECK((held.pose.center_world_mm - line().measured().imprint.pose.center_world_mm).norm() < 0.5);  // 4 frames' noise

  const Imprint blind = line().process(line().without_targets(), &keeper, ++second);
  CHECK(blind.failure.empty());
  CHECK(blind.pose_state == PoseState::hold);
  CHECK(blind.pose_doubtful);
  CHECK(blind.quality.targets_used == 0);
  CHECK_FALSE(line().process(line().without_targets(), nullptr, second).failure.empty());  // nothing kept: no pose

  const Imprint knocked = line().process(line().knocked(), &keeper, ++second);
  CHECK(knocked.failure.empty());
  CHECK(knocked.pose_state == PoseState::moved);
  CHECK(knocked.pose_doubtful);
  CHECK(knocked.pose_doubtful_since_ns == 5 * kSecond);  // the last frame whose targets confirmed the pose
}
