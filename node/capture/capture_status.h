#pragma once

#include <cstdint>
#include <string>

namespace imprint {

/// How a camera does, since the node's start.
struct CaptureStatus {
  std::uint64_t frames = 0;    ///< whole ones, whether asked for or not
  std::uint64_t dropped = 0;   ///< taken by the camera but never whole here
  std::uint64_t restarts = 0;  ///< times it was lost and opened anew
  std::string fault;           ///< why there are no frames now; empty: there are
};

}  // namespace imprint
