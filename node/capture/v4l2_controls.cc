#include "node/capture/v4l2_controls.h"

#include <linux/videodev2.h>

#include <cctype>
#include <charconv>
#include <cstring>

namespace imprint {
namespace {

// "Exposure Time, Absolute" is exposure_time_absolute.
std::string key_of(const char* title) {
  std::string key;
  for (; *title != '\0'; ++title) {
    const auto letter = static_cast<unsigned char>(*title);
    if (std::isalnum(letter) != 0) {
      key += static_cast<char>(std::tolower(letter));
    } else if (!key.empty() && key.back() != '_') {
      key += '_';
    }
  }
  while (!key.empty() && key.back() == '_') key.pop_back();
  return key;
}

v4l2_ext_controls one(v4l2_ext_control& control) {
  v4l2_ext_controls controls{};
  controls.which = V4L2_CTRL_WHICH_CUR_VAL;
  controls.count = 1;
  controls.controls = &control;
  return controls;
}

}  // namespace

V4l2Controls::V4l2Controls(std::shared_ptr<V4l2Device> device) : device_(std::move(device)) {
  v4l2_query_ext_ctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (controls_.size() < 1024 && device_->call(VIDIOC_QUERY_EXT_CTRL, &query) == 0) {
    const bool plain = query.type == V4L2_CTRL_TYPE_INTEGER || query.type == V4L2_CTRL_TYPE_BOOLEAN ||
                       query.type == V4L2_CTRL_TYPE_MENU || query.type == V4L2_CTRL_TYPE_INTEGER_MENU ||
                       query.type == V4L2_CTRL_TYPE_BITMASK || query.type == V4L2_CTRL_TYPE_INTEGER64 ||
                       query.type == V4L2_CTRL_TYPE_BUTTON;
    if (plain && (query.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) == 0U)
      controls_[key_of(query.name)] = {query.id, query.minimum, query.maximum, query.type == V4L2_CTRL_TYPE_BUTTON,
                                       query.type == V4L2_CTRL_TYPE_INTEGER64};
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
}

Result<void> V4l2Controls::set(const std::string& name, std::int64_t value) {
  const auto found = controls_.find(name);
  if (found == controls_.end()) {
    std::string names;
    for (const auto& [known, control] : controls_) names += (names.empty() ? "" : ", ") + known;
    return job_failed("camera.controls: no control \"{}\", but {}", name, names.empty() ? "none" : names);
  }
  const Control& control = found->second;
  if (!control.button && (value < control.lowest || value > control.highest))
    return job_failed("control {}: expected {} to {}, found {}", name, control.lowest, control.highest, value);
  v4l2_ext_control wanted{};
  wanted.id = control.id;
  if (control.wide) {
    wanted.value64 = value;
  } else {
    wanted.value = static_cast<std::int32_t>(value);
  }
  auto controls = one(wanted);
  if (const int fault = device_->call(VIDIOC_S_EXT_CTRLS, &controls))
    return job_failed("control {} = {}: {}", name, value, std::strerror(fault));
  return {};
}

Result<void> V4l2Controls::set(const CameraControl& control) {
  std::int64_t value = 0;
  const char* end = control.value.data() + control.value.size();
  if (const auto read = std::from_chars(control.value.data(), end, value); read.ec != std::errc{} || read.ptr != end)
    return job_failed("camera.controls: {}: expected a whole number, found \"{}\"", control.name, control.value);
  return set(control.name, value);
}

Result<std::int64_t> V4l2Controls::get(const std::string& name) const {
  const auto found = controls_.find(name);
  if (found == controls_.end()) return job_failed("no control \"{}\"", name);
  v4l2_ext_control asked{};
  asked.id = found->second.id;
  auto controls = one(asked);
  if (const int fault = device_->call(VIDIOC_G_EXT_CTRLS, &controls))
    return job_failed("control {}: {}", name, std::strerror(fault));
  return found->second.wide ? static_cast<std::int64_t>(asked.value64) : static_cast<std::int64_t>(asked.value);
}

}  // namespace imprint
