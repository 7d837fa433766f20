#include "cli/fleet_update.h"

namespace imprint {
namespace {

// Whether the board has got there; fails when it says that it never will.
Result<bool> has_changed(const BoardState& before, const BoardState& now, const FleetChange& change) {
  if (!now.fault.empty()) return false;  // starting anew
  if (now.update.starts_with("failed")) return job_failed("{}: {}", now.camera_id, now.update);
  const bool there = change.version.empty() ? now.slot != before.slot : now.version == change.version;
  if (there) return now.slot_good;
  if (!now.rolled_back.empty() && now.rolled_back != before.rolled_back)
    return job_failed("{}: went back to slot {}: {}", now.camera_id, now.slot, now.rolled_back);
  return false;
}

Result<void> change_board(Boards& boards, const std::string& camera, const FleetChange& change,
                          const std::function<void(const std::string&)>& tell) {
  const BoardState before = boards.state(camera);
  if (!before.fault.empty()) return job_failed("{}: {}", camera, before.fault);
  if (before.slot.empty()) return job_failed("{}: runs no board image", camera);
  if (!change.version.empty() && before.version == change.version && before.slot_good) {
    tell(fmt::format("{}: runs {} already", camera, before.version));
    return {};
  }
  if (auto wanted = boards.want(camera, change.wish); !wanted) return wanted;
  const auto deadline = boards.now() + change.board_timeout;
  std::string told;
  while (boards.now() < deadline) {
    boards.pause();
    const BoardState now = boards.state(camera);
    // What it said before the wish was taken up is no answer to it.
    if (now.update == before.update && now.slot == before.slot && now.rolled_back == before.rolled_back) continue;
    const auto changed = has_changed(before, now, change);
    if (!changed) return pass_on(changed.error());
    if (*changed) {
      tell(fmt::format("{}: runs {} from slot {}, judged good", camera, now.version, now.slot));
      return {};
    }
    const std::string doing = now.fault.empty() ? now.update : "starting";
    if (doing != told) tell(fmt::format("{}: {}", camera, doing));
    told = doing;
  }
  return job_failed("{}: not within {} s", camera, change.board_timeout.count());
}

}  // namespace

Result<void> change_fleet(Boards& boards, const std::vector<std::string>& cameras, const FleetChange& change,
                          const std::function<void(const std::string&)>& tell) {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (auto changed = change_board(boards, cameras[i], change, tell); !changed) {
      std::string left;
      for (std::size_t j = i + 1; j < cameras.size(); ++j) left += " " + cameras[j];
      return job_failed("{}; stopped{}", changed.error().message, left.empty() ? "" : ", as they were:" + left);
    }
  }
  return {};
}

}  // namespace imprint
