#include "fusion/fusion_config.h"

#include <algorithm>

#include "fusion/history/history_copy.h"
#include "lib/daemon/program.h"

namespace imprint {
namespace {

// A part's own complaint begins with its name for the key; here the key is the file's.
std::string without_key(const std::string& message) {
  const auto colon = message.find(": ");
  return colon == std::string::npos ? message : message.substr(colon + 2);
}

std::filesystem::path audit_beside(std::filesystem::path database) { return database += ".audit.jsonl"; }

HealthLimits read_alarms(TomlReader& read) {
  HealthLimits limits;
  limits.max_temperature_c = read.number("alarm.max_temperature_c", limits.max_temperature_c);
  limits.max_reprojection_px = read.number("alarm.max_reprojection_px", limits.max_reprojection_px);
  limits.max_blur_px = read.number("alarm.max_blur_px", limits.max_blur_px);
  limits.min_contrast = read.number("alarm.min_contrast", limits.min_contrast);
  limits.min_storage_mb = read.number("alarm.min_storage_mb", limits.min_storage_mb);
  limits.hysteresis = read.number("alarm.hysteresis", limits.hysteresis);
  limits.records = static_cast<int>(std::clamp<std::int64_t>(read.integer("alarm.records", limits.records), 0, 1000));
  if (const auto valid = limits.validate(); !valid) read.fault("alarm", valid.error().message);
  return limits;
}

std::string to_toml(const HealthLimits& limits) {
  return fmt::format(
      "[alarm]\nmax_temperature_c = {}\nmax_reprojection_px = {}\nmax_blur_px = {}\nmin_contrast = {}\n"
      "min_storage_mb = {}\nhysteresis = {}\nrecords = {}\n",
      toml_number(limits.max_temperature_c), toml_number(limits.max_reprojection_px), toml_number(limits.max_blur_px),
      toml_number(limits.min_contrast), toml_number(limits.min_storage_mb), toml_number(limits.hysteresis),
      limits.records);
}

SessionPlan read_plan(TomlReader& read, const std::string& section, SessionPlan plan) {
  plan.session = read.string(section + ".session", plan.session);
  plan.observations =
      static_cast<int>(std::clamp<std::int64_t>(read.integer(section + ".observations", plan.observations), 0, 1000));
  plan.rotation_step_deg = read.number(section + ".rotation_step_deg", plan.rotation_step_deg);
  plan.new_session_s = read.number(section + ".new_session_s", plan.new_session_s);
  return plan;
}

std::string to_toml(const SessionPlan& plan) {
  return fmt::format("session = {}\nobservations = {}\nrotation_step_deg = {}\nnew_session_s = {}\n",
                     toml_text(plan.session), plan.observations, toml_number(plan.rotation_step_deg),
                     toml_number(plan.new_session_s));
}

PlcConfig read_plc(TomlReader& read) {
  PlcConfig plc;
  plc.input = read.path("plc.input", plc.input);
  plc.plan = read_plan(read, "plc", plc.plan);
  plc.debounce_ms = read.number("plc.debounce_ms", plc.debounce_ms);
  if (const auto valid = plc.validate(); !valid) read.fault("plc", valid.error().message);
  return plc;
}

std::string to_toml(const PlcConfig& plc) {
  if (plc.input.empty()) return {};
  return fmt::format("\n[plc]\ninput = {}\n{}debounce_ms = {}\n", toml_text(plc.input.string()), to_toml(plc.plan),
                     toml_number(plc.debounce_ms));
}

RestTriggerConfig read_rest(TomlReader& read) {
  RestTriggerConfig rest;
  rest.accept = read.boolean("rest.accept", rest.accept);
  rest.plan = read_plan(read, "rest", rest.plan);
  rest.lead_ms = read.number("rest.lead_ms", rest.lead_ms);
  rest.quiet_s = read.number("rest.quiet_s", rest.quiet_s);
  if (const auto valid = rest.validate(); !valid) read.fault("rest", valid.error().message);
  return rest;
}

std::string to_toml(const RestTriggerConfig& rest) {
  return fmt::format("\n[rest]\naccept = {}\n{}lead_ms = {}\nquiet_s = {}\n", rest.accept, to_toml(rest.plan),
                     toml_number(rest.lead_ms), toml_number(rest.quiet_s));
}

std::string lines_to_toml(const std::vector<std::filesystem::path>& lines) {
  if (lines.empty()) return {};
  return fmt::format("lines = {}\n", toml_list({lines.begin(), lines.end()}));
}

bool is_tls(const std::string& endpoint) { return endpoint.starts_with("tls/"); }

}  // namespace

Result<FusionConfig> read_fusion_config(const std::filesystem::path& path, const toml::table& table) {
  FusionConfig config;
  TomlReader read(path, table);
  read.only({"fusion.site",
             "fusion.line",
             "fusion.rig",
             "fusion.database",
             "fusion.result_dir",
             "fusion.lines",
             "fusion.deadline_s",
             "fusion.max_spread_s",
             "fusion.max_clock_offset_s",
             "fusion.method",
             "fusion.geometry",
             "fusion.log_level",
             "history.postgresql",
             "zenoh.connect",
             "zenoh.listen",
             "zenoh.identity",
             "zenoh.insecure",
             "zenoh.access",
             "page.address",
             "page.port",
             "page.users",
             "page.insecure",
             "page.audit",
             "alarm.max_temperature_c",
             "alarm.max_reprojection_px",
             "alarm.max_blur_px",
             "alarm.min_contrast",
             "alarm.min_storage_mb",
             "alarm.hysteresis",
             "alarm.records",
             "plc.input",
             "plc.session",
             "plc.observations",
             "plc.rotation_step_deg",
             "plc.debounce_ms",
             "plc.new_session_s",
             "rest.accept",
             "rest.session",
             "rest.observations",
             "rest.rotation_step_deg",
             "rest.new_session_s",
             "rest.lead_ms",
             "rest.quiet_s"});
  config.site = read_id(read, "fusion.site", config.site);
  config.line = read_id(read, "fusion.line", config.line);
  config.rig = read.path("fusion.rig");
  config.database = read.path("fusion.database", std::filesystem::absolute(path).parent_path() / config.database);
  config.result_dir = read.path("fusion.result_dir", config.result_dir);
  config.postgresql = read.string("history.postgresql", config.postgresql);
  if (!config.postgresql.empty()) {
    if (const auto valid = check_postgres(config.postgresql); !valid)
      read.fault("history.postgresql", valid.error().message);
  }
  config.assembler.deadline_s = read.number("fusion.deadline_s", config.assembler.deadline_s);
  config.assembler.max_spread_s = read.number("fusion.max_spread_s", config.assembler.max_spread_s);
  config.assembler.max_clock_offset_s = read.number("fusion.max_clock_offset_s", config.assembler.max_clock_offset_s);
  for (const std::string& file : read.strings("fusion.lines", std::vector<std::string>{}))
    config.lines.push_back(std::filesystem::absolute(path).parent_path() / file);
  config.method = read_choice(read, "fusion.method", kMethods, config.method);
  config.geometry =
      geometry_method_of(read_choice(read, "fusion.geometry", kGeometryMethods, std::string(name_of(config.geometry))));
  config.log_level = read_choice(read, "fusion.log_level", kLogLevels, config.log_level);
  config.zenoh = read_zenoh_section(read, config.zenoh);
  config.access = read.path("zenoh.access", config.access);
  if (config.access.empty() && std::ranges::any_of(config.zenoh.listen, is_tls)) {
    read.fault("zenoh.access", "expected the plant's access.json: a router on TLS must know who may do what");
  }
  config.page.address = read.string("page.address", config.page.address);
  const std::int64_t port = read.integer("page.port", config.page.port);
  if (port < 0 || port > 65535) read.fault("page.port", fmt::format("expected 0 to 65535, found {}", port));
  config.page.port = static_cast<int>(std::clamp<std::int64_t>(port, 0, 65535));
  if (const auto valid = config.assembler.validate(); !valid) {
    const std::string& message = valid.error().message;
    read.fault("fusion." + message.substr(0, message.find(':')), without_key(message));
  }
  config.page.users = read.path("page.users", config.page.users);
  config.page.insecure = read.boolean("page.insecure", config.page.insecure);
  config.page.audit = read.path("page.audit", audit_beside(config.database));
  if (!config.page.is_local()) config.page.identity = config.zenoh.identity;
  config.alarms = read_alarms(read);
  config.plc = read_plc(read);
  config.rest = read_rest(read);
  if (const auto valid = config.page.validate(); !valid) read.fault("page.address", without_key(valid.error().message));
  if (config.zenoh.listen.empty() && config.zenoh.connect.empty()) {
    read.fault("zenoh.listen", "no endpoint here nor in zenoh.connect: no camera could reach this program");
  }
  if (const auto error = read.error()) return pass_on(*error);
  return config;
}

std::string to_toml(const FusionConfig& config) {
  return fmt::format(
      "[fusion]\nsite = {}\nline = {}\nrig = {}\ndatabase = {}\n{}{}deadline_s = {}\nmax_spread_s = {}\n"
      "max_clock_offset_s = {}\nmethod = {}\ngeometry = {}\nlog_level = {}\n\n{}"
      "[zenoh]\n{}{}\n[page]\naddress = {}\nport = {}\n{}insecure = {}\naudit = {}\n\n{}",
      toml_text(config.site), toml_text(config.line), toml_text(config.rig.string()),
      toml_text(config.database.string()),
      config.result_dir.empty() ? "" : fmt::format("result_dir = {}\n", toml_text(config.result_dir.string())),
      lines_to_toml(config.lines), toml_number(config.assembler.deadline_s), toml_number(config.assembler.max_spread_s),
      toml_number(config.assembler.max_clock_offset_s), toml_text(config.method), toml_text(name_of(config.geometry)),
      toml_text(config.log_level),
      config.postgresql.empty() ? "" : fmt::format("[history]\npostgresql = {}\n\n", toml_text(config.postgresql)),
      zenoh_to_toml(config.zenoh),
      config.access.empty() ? "" : fmt::format("access = {}\n", toml_text(config.access.string())),
      toml_text(config.page.address), config.page.port,
      config.page.users.empty() ? "" : fmt::format("users = {}\n", toml_text(config.page.users.string())),
      config.page.insecure, toml_text(config.page.audit.string()),
      to_toml(config.alarms) + to_toml(config.plc) + to_toml(config.rest));
}

}  // namespace imprint
