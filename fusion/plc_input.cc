#include "fusion/plc_input.h"

#include <fstream>

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"

namespace imprint {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(2);
constexpr auto kAfterFault = std::chrono::seconds(1);

// The first character that is no space: 0 or 1.
std::optional<bool> read_level(const std::filesystem::path& path) {
  std::ifstream file(path);
  char level = '\0';
  if (!(file >> level) || (level != '0' && level != '1')) return std::nullopt;
  return level == '1';
}

}  // namespace

Result<void> PlcConfig::validate() const {
  if (auto valid = plan.validate(); !valid) return valid;
  if (!(debounce_ms >= 0.0 && debounce_ms <= 10'000.0))
    return invalid_input("debounce_ms: expected 0 to 10000, found {}", debounce_ms);
  return {};
}

bool RisingEdge::note(bool level, Time now) {
  if (!settled_) {
    settled_ = candidate_ = level;
    since_ = now;
    return false;
  }
  if (level != candidate_) {
    candidate_ = level;
    since_ = now;
  }
  if (candidate_ == *settled_ || now - since_ < debounce_) return false;
  settled_ = candidate_;
  return candidate_;
}

Result<std::unique_ptr<PlcInput>> PlcInput::start(const PlcConfig& config, LineControl& control) {
  if (!read_level(config.input))
    return invalid_input("plc.input: {}: expected a file that reads 0 or 1", config.input.string());
  std::unique_ptr<PlcInput> input(new PlcInput(config, control));
  input->thread_ = std::thread([self = input.get()] { self->watch(); });
  return input;
}

PlcInput::~PlcInput() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

void PlcInput::watch() {
  bool readable = true;
  while (!stopping_) {
    const auto level = read_level(config_.input);
    if (!level && readable) spdlog::error("plc.input: {}: cannot be read any more", config_.input.string());
    readable = level.has_value();
    const auto now = std::chrono::steady_clock::now();
    if (level && edge_.note(*level, now)) {
      const Trigger trigger = sessions_.next(now, wall_clock_ns());
      spdlog::info("the PLC's input rose: session {} observation {}", trigger.session, trigger.observation);
      if (const auto fired = control_.fire(trigger); !fired) spdlog::error("not triggered: {}", fired.error().message);
    }
    if (readable)
      std::this_thread::sleep_for(kPeriod);
    else
      std::this_thread::sleep_for(kAfterFault);
  }
}

}  // namespace imprint
