#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace imprint {

/// Lets callbacks through until it is closed. A transport may call once more after a declaration was taken
/// back; behind a gate the owner of the callback knows that none runs after close().
class CallbackGate {
 public:
  /// Runs `call` unless the gate is closed; several threads may be inside.
  template <class Call>
  void pass(Call&& call) {
    const Visit visit(*this);
    if (visit.admitted) std::forward<Call>(call)();
  }

  /// From now on no call begins; waits for those that run, but not for the one it is itself called from.
  void close();

 private:
  struct Visit {
    explicit Visit(CallbackGate& g) : gate(g), admitted(g.enter()) {}
    ~Visit() {
      if (admitted) gate.leave();
    }
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;
    CallbackGate& gate;
    const bool admitted;
  };

  bool enter();
  void leave();

  std::mutex mutex_;
  std::condition_variable left_;
  bool open_ = true;
  std::vector<std::thread::id> inside_;  // few: one entry a running call
};

}  // namespace imprint
