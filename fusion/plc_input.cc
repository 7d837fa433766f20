#include "fusion/plc_input.h"

#include <fstream>

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"
#include "lib/wire/keys.h"

namespace imprint {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(2);
constexpr auto kAfterFault = std::chrono::seconds(1);
constexpr std::size_t kMaxSessionBytes = 32;  // the time comes behind it

// The first character that is no space: 0 or 1.
std::optional<bool> read_level(const std::filesystem::path& path) {
  std::ifstream file(path);
  char level = '\0';
  if (!(file >> level) || (level != '0' && level != '1')) return std::nullopt;
  return level == '1';
}

}  // namespace

Result<void> PlcConfig::validate() const {
  if (auto valid = check_id("session", session); !valid) return valid;
  if (session.size() > kMaxSessionBytes)
    return invalid_input("session: expected at most {} characters, found {}", kMaxSessionBytes, session.size());
  if (observations < 1 || observations > 64)
    return invalid_input("observations: expected 1 to 64, found {}", observations);
  if (!(rotation_step_deg >= -360.0 && rotation_step_deg <= 360.0))
    return invalid_input("rotation_step_deg: expected -360 to 360, found {}", rotation_step_deg);
  if (!(debounce_ms >= 0.0 && debounce_ms <= 10'000.0))
    return invalid_input("debounce_ms: expected 0 to 10000, found {}", debounce_ms);
  if (!(new_session_s > 0.0 && new_session_s <= 86'400.0))
    return invalid_input("new_session_s: expected more than 0, at most 86400, found {}", new_session_s);
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

Trigger PlcSessions::next(Time now, std::int64_t wall_ns) {
  const bool over = taken_ >= static_cast<std::uint32_t>(config_.observations);
  const bool left = now - last_ >= std::chrono::duration<double>(config_.new_session_s);
  if (session_.empty() || over || left) {
    std::string time = utc_text(wall_ns).substr(0, 23);  // 2025-12-31T23:59:59.999
    std::erase_if(time, [](char c) { return c == '-' || c == ':'; });
    session_ = config_.session + '-' + time;
    taken_ = 0;
  }
  last_ = now;
  Trigger trigger;
  trigger.session = session_;
  trigger.observation = taken_;
  trigger.rotation_deg = config_.rotation_step_deg * taken_;
  trigger.observations_expected = static_cast<std::uint32_t>(config_.observations);
  ++taken_;
  return trigger;
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
