#include "node/service/remote_settings.h"

#include <algorithm>
#include <array>
#include <sstream>
#include <string_view>

#include "lib/config/atomic_file.h"
#include "lib/config/toml_file.h"
#include "lib/log/log.h"

namespace imprint {
namespace {

constexpr const char* kKept = "settings";  // one assignment a line
constexpr const char* kProposed = "settings.trial";
constexpr const char* kTried = "settings.tried";      // a start has begun the trial
constexpr const char* kRefused = "settings.refused";  // why the last one is not in force
// Another name, place or certificate is another node; without its folder it would not find these settings again.
constexpr auto kNotFromAfar = std::to_array<std::string_view>(
    {"node.site", "node.line", "node.camera_id", "node.data_dir", "zenoh.identity", "zenoh.insecure"});

std::string key_of(const std::string& assignment) { return assignment.substr(0, assignment.find('=')); }

bool is_there(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

Result<std::vector<std::string>> read_lines(const std::filesystem::path& path) {
  std::vector<std::string> lines;
  if (!is_there(path)) return lines;
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  std::istringstream stream(*text);
  for (std::string line; std::getline(stream, line);)
    if (!line.empty()) lines.push_back(line);
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

void forget(const std::filesystem::path& path) {
  std::error_code failed;
  std::filesystem::remove(path, failed);
  if (failed) spdlog::error("{}: cannot be removed: {}", path.string(), failed.message());
}

}  // namespace

Result<RemoteSettings> RemoteSettings::open(std::filesystem::path folder) {
  RemoteSettings settings(std::move(folder));
  auto kept = read_lines(settings.file(kKept));
  if (!kept) return pass_on(kept.error());
  settings.kept_ = std::move(*kept);
  auto proposed = read_lines(settings.file(kProposed));
  if (!proposed) return pass_on(proposed.error());
  settings.proposed_ = std::move(*proposed);
  const auto refused = read_lines(settings.file(kRefused));
  if (refused && !refused->empty()) settings.refused_ = refused->front();
  if (is_there(settings.file(kTried))) settings.roll_back("the node ended while they were tried");
  return settings;
}

Result<void> RemoteSettings::lay_over(toml::table& table) {
  if (!proposed_.empty()) {
    if (auto written = write_file_atomically(file(kTried), ""); !written) return written;
    on_trial_ = true;
  }
  for (const std::string& assignment : on_trial_ ? proposed_ : kept_) {
    if (auto applied = apply_override(table, assignment); !applied)
      return invalid_input("{}: {}", file(on_trial_ ? kProposed : kKept).string(), applied.error().message);
  }
  return {};
}

Result<std::vector<std::string>> RemoteSettings::with(const std::vector<std::string>& assignments) const {
  std::vector<std::string> settings = kept_;
  for (const std::string& assignment : assignments) {
    const std::string key = key_of(assignment);
    if (key.size() == assignment.size() || key.find('.') == std::string::npos ||
        assignment.find('\n') != std::string::npos)
      return invalid_input("setting \"{}\": expected section.key=value", assignment);
    if (std::ranges::find(kNotFromAfar, key) != kNotFromAfar.end())
      return invalid_input("{}: cannot be set from afar: it would make this another node", key);
    std::erase_if(settings, [&](const std::string& other) { return key_of(other) == key; });
    settings.push_back(assignment);
  }
  return settings;
}

Result<void> RemoteSettings::propose(const std::vector<std::string>& settings) {
  forget(file(kRefused));
  return write_file_atomically(file(kProposed), joined(settings));
}

Result<void> RemoteSettings::accept() {
  forget(file(kTried));  // first: ended here, the next start tries again
  if (auto written = write_file_atomically(file(kKept), joined(proposed_)); !written) return written;
  kept_ = std::move(proposed_);
  proposed_.clear();
  refused_.clear();
  on_trial_ = false;
  forget(file(kProposed));
  spdlog::info("settings from afar in force: {}", fmt::join(kept_, ", "));
  return {};
}

void RemoteSettings::roll_back(const std::string& why) {
  spdlog::error("settings from afar rolled back: {}", why);
  refused_ = why;
  proposed_.clear();
  on_trial_ = false;
  if (auto written = write_file_atomically(file(kRefused), why + "\n"); !written)
    spdlog::error("{}", written.error().message);
  forget(file(kProposed));
  forget(file(kTried));
}

}  // namespace imprint
