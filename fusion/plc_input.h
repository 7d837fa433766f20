#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "fusion/serve/line_control.h"
#include "fusion/trigger_sessions.h"
#include "lib/result/result.h"

namespace imprint {

/// A PLC's digital input that triggers. All ours.
struct PlcConfig {
  std::filesystem::path input{};  // reads 0 or 1, e.g. /sys/class/gpio/gpio17/value; empty: there is none
  SessionPlan plan{.session = "plc"};
  double debounce_ms = 20.0;  // the input must stand so long to count

  [[nodiscard]] Result<void> validate() const;
};

/// When an input that bounces has risen.
class RisingEdge {
 public:
  using Time = std::chrono::steady_clock::time_point;
  explicit RisingEdge(std::chrono::duration<double, std::milli> debounce) : debounce_(debounce) {}

  /// True once for each rise that has stood for the debounce time. What is high from the start is no rise.
  bool note(bool level, Time now);

 private:
  std::chrono::duration<double, std::milli> debounce_;
  std::optional<bool> settled_;
  bool candidate_ = false;
  Time since_;
};

/// Watches the input on a thread of its own, every 2 ms, and fires all cameras at each rise.
class PlcInput {
 public:
  /// Fails (invalid_input) when the input cannot be read.
  static Result<std::unique_ptr<PlcInput>> start(const PlcConfig& config, LineControl& control);
  ~PlcInput();
  PlcInput(const PlcInput&) = delete;
  PlcInput& operator=(const PlcInput&) = delete;

 private:
  PlcInput(const PlcConfig& config, LineControl& control)
      : config_(config),
        control_(control),
        edge_(std::chrono::duration<double, std::milli>(config.debounce_ms)),
        sessions_(config.plan) {}
  void watch();

  PlcConfig config_;
  LineControl& control_;
  RisingEdge edge_;
  TriggerSessions sessions_;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace imprint
