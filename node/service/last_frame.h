#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "lib/result/result.h"
#include "lib/service/document_desk.h"
#include "node/capture/frame.h"
#include "node/node_pipeline.h"

namespace imprint {

/// The last frame a node has worked on and what it found there, for whoever wants to look at a part of it. Safe to use
/// from several threads.
class LastFrame {
 public:
  void keep(const Frame& frame, const ProcessedFrame& found);
  /// A frame that is still being worked on, in the last one's place, as both at once would take twice the memory. The
  /// camera stands still: until more is known, rims and targets are where the last frame showed them.
  void begin(const Frame& frame);

  /// A part of the frame as a line of JSON (`{"x_px", "y_px", "width_px", "height_px", "scale", "what", "source",
  /// "sensor_time"}`, the part in pixels of the frame) and behind it a grey JPEG of at most `bytes` (500 to 65,536,
  /// default 3,600). Parameters: `region=x,y,width,height`, `target=ID` or nothing for the rims; `stretch=1` spreads
  /// the grey levels that are there over all. A part that does not fit is made smaller, then coarser. Fails
  /// (invalid_input, job_failed) with what was expected.
  [[nodiscard]] Result<Bytes> crop(const Parameters& parameters) const;

 private:
  struct Spot {
    int id = 0;
    cv::Rect around;
  };
  struct Seen {
    cv::Mat image;
    std::string source;
    std::int64_t sensor_time_ns = 0;
    std::vector<Spot> targets;
    std::optional<cv::Rect> rims;
  };
  static Result<cv::Rect> part_of(const Seen& seen, const Parameters& parameters, std::string& what);

  mutable std::mutex mutex_;
  std::optional<Seen> seen_;
};

}  // namespace imprint
