#include "node/capture/frame_ring.h"

#include <catch2/catch.hpp>

namespace imprint {
namespace {

RawFrame taken_at(std::int64_t time_ns, std::shared_ptr<const void> buffer = nullptr) {
  RawFrame frame;
  frame.sensor_time_ns = time_ns;
  frame.buffer = std::move(buffer);
  return frame;
}

std::int64_t time_of(const std::optional<RawFrame>& frame) { return frame ? frame->sensor_time_ns : -1; }

FrameRing ring_of_three() {  // of five frames, taken at 10, 20, 30, 40 and 50
  FrameRing ring(3);
  for (std::int64_t time_ns = 10; time_ns <= 50; time_ns += 10) ring.add(taken_at(time_ns));
  return ring;
}

}  // namespace

TEST_CASE("recent frames: a moment that has passed is served with the frame nearest to it") {
  const FrameRing ring = ring_of_three();
  CHECK(time_of(ring.nearest(44)) == 40);
  CHECK(time_of(ring.nearest(46)) == 50);
  CHECK(time_of(ring.nearest(30)) == 30);
}

TEST_CASE("recent frames: as long as a nearer frame may come there is none") {
  CHECK_FALSE(ring_of_three().nearest(51));
  CHECK_FALSE(ring_of_three().first_since(51));
  CHECK(time_of(ring_of_three().first_since(41)) == 50);
  CHECK_FALSE(FrameRing(3).nearest(0));
}

TEST_CASE("recent frames: a moment whose frame is gone is known to be") {
  const FrameRing ring = ring_of_three();
  CHECK(ring.reaches_back_to(30));
  CHECK(ring.reaches_back_to(26));
  CHECK_FALSE(ring.reaches_back_to(20));
  CHECK_FALSE(FrameRing(3).reaches_back_to(20));
}

TEST_CASE("recent frames: the oldest gives its buffer back to the camera") {
  FrameRing ring(2);
  auto buffer = std::make_shared<const int>(0);
  ring.add(taken_at(10, buffer));
  const std::weak_ptr<const int> watched = buffer;
  buffer.reset();
  ring.add(taken_at(20));
  CHECK_FALSE(watched.expired());
  ring.add(taken_at(30));
  CHECK(watched.expired());
}

TEST_CASE("recent frames: a clock set back forgets what was taken before") {
  FrameRing ring = ring_of_three();
  ring.add(taken_at(15));
  CHECK(time_of(ring.nearest(12)) == 15);
  CHECK_FALSE(ring.nearest(40));
}

}  // namespace imprint
