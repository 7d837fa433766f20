#include "fusion/serve/alarm_list.h"

#include "lib/clock/wall_clock.h"

namespace imprint {

using nlohmann::json;

void AlarmList::set(const std::string& name, const std::string& text, std::int64_t now_ns) {
  const auto found = standing_.find(name);
  if (!text.empty()) {
    if (found == standing_.end())
      standing_[name] = {.text = text, .since_ns = now_ns, .acknowledged_by = {}};
    else
      found->second.text = text;
    return;
  }
  if (found == standing_.end()) return;
  if (found->second.acknowledged_by.empty()) {
    if (ended_.size() >= kMaxEnded) ended_.pop_front();
    ended_.push_back({name, found->second, now_ns});
  }
  standing_.erase(found);
}

bool AlarmList::acknowledge(const std::string& name, const std::string& who, std::int64_t now_ns) {
  const bool was_ended = std::erase_if(ended_, [&](const Ended& ended) { return ended.name == name; }) > 0;
  const auto found = standing_.find(name);
  if (found == standing_.end() || !found->second.acknowledged_by.empty()) return was_ended;
  found->second.acknowledged_by = who;
  found->second.acknowledged_ns = now_ns;
  return true;
}

json AlarmList::standing() const {
  json list = json::array();
  for (const auto& [name, alarm] : standing_) {
    json entry = {{"name", name},
                  {"text", alarm.text},
                  {"since", utc_text(alarm.since_ns)},
                  {"acknowledged_by", nullptr},
                  {"acknowledged_at", nullptr}};
    if (!alarm.acknowledged_by.empty()) {
      entry["acknowledged_by"] = alarm.acknowledged_by;
      entry["acknowledged_at"] = utc_text(alarm.acknowledged_ns);
    }
    list.push_back(std::move(entry));
  }
  return list;
}

json AlarmList::ended() const {
  json list = json::array();
  for (const Ended& ended : ended_) {
    list.push_back({{"name", ended.name},
                    {"text", ended.alarm.text},
                    {"since", utc_text(ended.alarm.since_ns)},
                    {"ended", utc_text(ended.ended_ns)}});
  }
  return list;
}

}  // namespace imprint
