#include "lib/wire/keys.h"

#include <algorithm>

#include "lib/wire/wire_text.h"

namespace imprint {
namespace {

bool is_id_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
}

}  // namespace

Result<void> check_id(std::string_view what, std::string_view id) {
  const bool sized = !id.empty() && id.size() <= kMaxIdBytes;
  if (sized && std::all_of(id.begin(), id.end(), is_id_character) && id.front() != '.' && id.front() != '-') return {};
  return invalid_input("{}{}expected 1 to {} of A-Z a-z 0-9 . _ -, not beginning with '.' or '-', found '{}'", what,
                       what.empty() ? "" : " id: ", kMaxIdBytes, wire_line(id, kMaxIdBytes + 16));
}

Result<Keys> Keys::of(std::string_view site, std::string_view line) {
  if (auto checked = check_id("site", site); !checked) return pass_on(checked.error());
  if (auto checked = check_id("line", line); !checked) return pass_on(checked.error());
  return Keys(fmt::format("imprint/{}/{}/v1", site, line));
}

std::string Keys::camera(std::string_view camera_id, std::string_view leaf) const {
  return fmt::format("{}/cam/{}/{}", root_, camera_id, leaf);
}

std::string Keys::imprint(std::string_view camera_id) const { return camera(camera_id, "imprint"); }
std::string Keys::health(std::string_view camera_id) const { return camera(camera_id, "health"); }
std::string Keys::alive(std::string_view camera_id) const { return camera(camera_id, "alive"); }
std::string Keys::receipt(std::string_view camera_id) const { return camera(camera_id, "receipt"); }
std::string Keys::rest(std::string_view camera_id) const { return camera(camera_id, "rest"); }
std::string Keys::delivery(std::string_view camera_id) const { return camera(camera_id, "delivery"); }
std::string Keys::service(std::string_view camera_id, std::string_view name) const {
  return camera(camera_id, fmt::format("service/{}", name));
}
std::string Keys::trigger() const { return root_ + "/trigger"; }
std::string Keys::result(std::string_view session) const { return fmt::format("{}/result/{}", root_, session); }
std::string Keys::fusion_service(std::string_view name) const {
  return fmt::format("{}/fusion/service/{}", root_, name);
}
std::string Keys::fusion_alive() const { return root_ + "/fusion/alive"; }
std::string Keys::everything() const { return root_ + "/**"; }

std::optional<std::string> Keys::camera_of(std::string_view key) const {
  const std::string front = root_ + "/cam/";
  if (!key.starts_with(front)) return std::nullopt;
  const std::string_view rest = key.substr(front.size());
  const auto slash = rest.find('/');
  if (slash == std::string_view::npos || !check_id("camera", rest.substr(0, slash))) return std::nullopt;
  return std::string(rest.substr(0, slash));
}

}  // namespace imprint
