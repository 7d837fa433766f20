#include "node/service/node_desk.h"

#include <sys/utsname.h>

#include <algorithm>
#include <sstream>

#include <zlib.h>
#include <nlohmann/json.hpp>

#include "lib/clock/wall_clock.h"
#include "lib/config/atomic_file.h"
#include "lib/log/log.h"
#include "lib/service/log_document.h"

namespace imprint {
namespace {

using nlohmann::json;

constexpr std::size_t kBundleLogLines = 500;

Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

Bytes bytes_of(const json& document) { return bytes_of(document.dump(-1, ' ', false, json::error_handler_t::replace)); }

Result<Bytes> zipped(const Bytes& bytes) {
  z_stream stream{};
  constexpr int kGzip = 15 + 16;  // zlib's way to ask for it
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip, 9, Z_DEFAULT_STRATEGY) != Z_OK)
    return job_failed("bundle: zlib could not begin");
  Bytes out(deflateBound(&stream, bytes.size()));
  stream.next_in = const_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const int done = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (done != Z_STREAM_END) return job_failed("bundle: zlib could not finish");
  return out;
}

json machine() {
  utsname name{};
  ::uname(&name);
  json document = {{"host", name.nodename}, {"kernel", name.release}, {"machine", name.machine}};
  for (const char* file : {"/proc/meminfo", "/proc/uptime", "/proc/loadavg", "/etc/os-release"}) {
    const auto text = read_file(file);
    document[file] = text ? *text : text.error().message;
  }
  return document;
}

}  // namespace

Result<std::unique_ptr<NodeDesk>> NodeDesk::open(Transport& transport, const Keys& keys, Node node,
                                                 RemoteSettings& settings, const LastFrame& frame) {
  const std::string id = node.config.camera_id;
  std::unique_ptr<NodeDesk> opened(new NodeDesk(std::move(node), settings, frame));
  NodeDesk* self = opened.get();
  auto watch = transport.watch_liveness(keys.fusion_alive(), [seen = self->fusion_seen_](std::string_view, bool alive) {
    if (alive) *seen = true;
  });
  if (!watch) return pass_on(watch.error());
  self->fusion_watch_ = std::move(*watch);
  auto desk = DocumentDesk::open(
      transport,
      {{keys.service(id, "config"), [self](const Parameters&, const Bytes&) { return self->config_document(); }},
       {keys.service(id, "configure"),
        [self](const Parameters& parameters, const Bytes& payload) { return self->configure(parameters, payload); }},
       {keys.service(id, "log"), log_document},
       {keys.service(id, "crop"),
        [self](const Parameters& parameters, const Bytes&) { return self->frame_.crop(parameters); }},
       {keys.service(id, "firmware"), [self](const Parameters&, const Bytes&) { return self->board_.status(); }},
       {keys.service(id, "update"),
        [self](const Parameters&, const Bytes& payload) {
          return self->board_.want(std::string(payload.begin(), payload.end()));
        }},
       {keys.service(id, "bundle"), [self](const Parameters&, const Bytes&) { return self->bundle(); }}});
  if (!desk) return pass_on(desk.error());
  self->desk_ = std::move(*desk);
  return opened;
}

Result<void> NodeDesk::accept_settings() {
  const std::lock_guard lock(settings_mutex_);
  return settings_.accept();
}

Result<Bytes> NodeDesk::config_document() {
  const std::lock_guard lock(settings_mutex_);
  return bytes_of(json{{"schema", "imprint.node_config/1"},
                       {"camera", node_.config.camera_id},
                       {"version", node_.version},
                       {"config", to_toml(node_.config)},
                       {"settings", settings_.kept()},
                       {"on_trial", settings_.on_trial() || restart_wanted_},
                       {"refused", settings_.refused()}});
}

Result<Bytes> NodeDesk::configure(const Parameters& parameters, const Bytes& payload) {
  const std::lock_guard lock(settings_mutex_);
  if (settings_.on_trial() || restart_wanted_)
    return job_failed("settings are on trial at this moment; try again in a minute");
  std::vector<std::string> assignments;
  std::istringstream lines(std::string(payload.begin(), payload.end()));
  for (std::string line; std::getline(lines, line);)
    if (!line.empty()) assignments.push_back(line);
  if (assignments.empty()) return invalid_input("expected section.key=value, found nothing");
  const auto settings = settings_.with(assignments);
  if (!settings) return pass_on(settings.error());
  toml::table table = node_.own_table;
  for (const std::string& setting : *settings)
    if (auto applied = apply_override(table, setting); !applied) return pass_on(applied.error());
  const auto config = read_node_config(node_.config_file, table);
  if (!config) return pass_on(config.error());
  if (auto checked = node_.check(*config); !checked) return pass_on(checked.error());
  if (!parameters.contains("check")) {
    if (auto proposed = settings_.propose(*settings); !proposed) return pass_on(proposed.error());
    spdlog::warn("settings from afar on trial: {}; starting anew", fmt::join(assignments, ", "));
    restart_wanted_ = true;
  }
  return bytes_of(json{{"settings", *settings}, {"on_trial", !parameters.contains("check")}});
}

Result<Bytes> NodeDesk::bundle() {
  const auto config = config_document();
  json document = {{"schema", "imprint.bundle/1"},
                   {"made_at", utc_text(wall_clock_ns())},
                   {"node", json::parse(*config, nullptr, false)},
                   {"machine", machine()},
                   {"log", recent_log(kBundleLogLines)}};
  const std::filesystem::path rig = node_.config.rig;
  const auto rig_text = read_file(rig);
  document["rig"] = {{"path", rig.string()}, {"text", rig_text ? *rig_text : rig_text.error().message}};
  std::error_code failed;
  const auto space = std::filesystem::space(node_.config.data_dir, failed);
  if (!failed) document["storage_free_bytes"] = space.available;
  return zipped(bytes_of(document));
}

}  // namespace imprint
