#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// What a board says of its image (node/service/board_update.h).
struct BoardState {
  std::string camera_id;
  std::string version;  ///< of the image; empty: no image
  std::string slot;
  bool slot_good = false;
  std::string update;       ///< what became of the last wish
  std::string rolled_back;  ///< why it went back to this slot
  std::string fault;        ///< why the board did not say; empty: it did
};

/// What a fleet's update does to its boards, apart so that tests need no boards.
class Boards {
 public:
  virtual ~Boards() = default;
  virtual BoardState state(const std::string& camera_id) = 0;
  /// The address of a bundle, or "rollback".
  virtual Result<void> want(const std::string& camera_id, const std::string& wish) = 0;
  virtual void pause() = 0;  ///< between two looks
  virtual std::chrono::steady_clock::time_point now() = 0;
};

struct FleetChange {
  std::string wish;                          ///< as Boards::want takes it
  std::string version;                       ///< the boards are to run then; empty: another slot than before
  std::chrono::seconds board_timeout{1200};  ///< in which a board must run it and have judged it good
};

/// One board after the other, the first alone: the next is only begun when the one before runs what was wished and has
/// judged it good. `tell` is called with what happens. Fails (job_failed) with the first board that does not, and
/// leaves those after it as they are.
Result<void> change_fleet(Boards& boards, const std::vector<std::string>& cameras, const FleetChange& change,
                          const std::function<void(const std::string&)>& tell);

}  // namespace imprint
