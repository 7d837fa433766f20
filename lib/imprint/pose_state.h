#pragma once

#include <array>
#include <string_view>

namespace imprint {

/// Where the pose of an imprint comes from, node/pose/pose_keeper.h.
enum class PoseState {
  tracking,  ///< from this frame, or refined over the frames before it: no hot forging kept from it
  hold,      ///< kept from before the forging came; the frame's own targets do not contradict it
  moved,     ///< the kept pose no longer held: taken anew from this frame
};

inline constexpr std::array<std::string_view, 3> kPoseStateNames{"tracking", "hold", "moved"};

constexpr std::string_view pose_state_name(PoseState state) { return kPoseStateNames[static_cast<std::size_t>(state)]; }

/// `tracking` for what is no state: the value of a sender that does not keep poses.
constexpr PoseState pose_state_from(int value) {
  return value == 1 ? PoseState::hold : value == 2 ? PoseState::moved : PoseState::tracking;
}

constexpr PoseState pose_state_from(std::string_view name) {
  return name == "hold" ? PoseState::hold : name == "moved" ? PoseState::moved : PoseState::tracking;
}

}  // namespace imprint
