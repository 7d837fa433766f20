// Times every stage of the node on one frame, on one core, beside cv::Canny on the same frame in the same run.
#include <algorithm>
#include <chrono>
#include <functional>
#include <iostream>
#include <map>
#include <vector>

#include <fmt/core.h>
#include <sys/resource.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "lib/rig/rig.h"
#include "node/capture/image_file.h"
#include "node/node_pipeline.h"

namespace {

using namespace imprint;

constexpr int kRounds = 5;

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double milliseconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

// The peer: edges of the whole frame as any program would find them first.
double canny_ms(const cv::Mat& image) {
  cv::Mat grey = image, edges;
  if (image.depth() == CV_16U) image.convertTo(grey, CV_8U, 1.0 / 256.0);
  return milliseconds_of([&] { cv::Canny(grey, edges, 40.0, 80.0); });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: node_bench rig.toml CAMERA_ID IMAGE\n";
    return 2;
  }
  cv::setNumThreads(1);
  const auto rig = read_rig(argv[1]);
  const auto* camera = rig ? rig->find_camera(argv[2]) : nullptr;
  const auto frame = read_image(argv[3], nullptr);
  if (!rig || camera == nullptr || !frame) {
    std::cerr << (!rig ? rig.error().message : !frame ? frame.error().message : "no such camera in the rig") << '\n';
    return 2;
  }
  const double memory_before_mb = peak_memory_mb();
  std::vector<std::string> order;
  std::map<std::string, std::vector<double>> times;
  for (int round = 0; round < kRounds; ++round) {
    const auto processed = process_frame(*frame, *camera, *rig, EdgeMethod::best);
    if (processed.error) {
      std::cerr << processed.error->message << '\n';
      return 1;
    }
    double whole = 0.0;
    for (const auto& [stage, time] : processed.stage_times) {
      if (round == 0) order.push_back(stage);
      times[stage].push_back(static_cast<double>(time.count()) / 1000.0);
      whole += times[stage].back();
    }
    times["all stages"].push_back(whole);
  }
  const double memory_mb = peak_memory_mb();
  for (int round = 0; round < kRounds; ++round) times["cv::Canny"].push_back(canny_ms(frame->image));
  order.insert(order.end(), {"all stages", "cv::Canny"});
  const double peer = median(times["cv::Canny"]);
  fmt::print("{} x {} px, one core, median of {} rounds\n", frame->image.cols, frame->image.rows, kRounds);
  fmt::print("{:<12} {:>9} {:>12}\n", "stage", "ms", "x cv::Canny");
  for (const std::string& name : order)
    fmt::print("{:<12} {:>9.1f} {:>12.2f}\n", name, median(times[name]), median(times[name]) / peer);
  fmt::print("peak memory {:.0f} MB (with the frame read: {:.0f} MB before the first stage)\n", memory_mb,
             memory_before_mb);
  return 0;
}
