#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

namespace imprint {

/// Conditions that need a person. An alarm stands from when its condition begins until it ends; somebody may
/// acknowledge it, which changes nothing but says so. One that ends before anybody did is kept until then, so that it
/// is not missed.
class AlarmList {
 public:
  static constexpr std::size_t kMaxEnded = 50;  // the oldest go

  /// An empty text ends the alarm; another text than before changes the words of the same alarm.
  void set(const std::string& name, const std::string& text, std::int64_t now_ns);
  /// False when there is no such alarm that nobody has acknowledged yet.
  bool acknowledge(const std::string& name, const std::string& who, std::int64_t now_ns);

  [[nodiscard]] bool any() const { return !standing_.empty(); }
  [[nodiscard]] bool stands(const std::string& name) const { return standing_.contains(name); }
  /// `[{"name", "text", "since", "acknowledged_by", "acknowledged_at"}]`, the last two null until then.
  [[nodiscard]] nlohmann::json standing() const;
  /// `[{"name", "text", "since", "ended"}]`: ended and not acknowledged.
  [[nodiscard]] nlohmann::json ended() const;

 private:
  struct Alarm {
    std::string text;
    std::int64_t since_ns = 0;
    std::string acknowledged_by;
    std::int64_t acknowledged_ns = 0;
  };
  struct Ended {
    std::string name;
    Alarm alarm;
    std::int64_t ended_ns = 0;
  };
  std::map<std::string, Alarm> standing_;
  std::deque<Ended> ended_;
};

}  // namespace imprint
