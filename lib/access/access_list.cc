#include "lib/access/access_list.h"

#include <algorithm>
#include <array>
#include <utility>

#include <nlohmann/json.hpp>

#include "lib/access/schema_list.h"
#include "lib/clock/wall_clock.h"
#include "lib/config/atomic_file.h"
#include "lib/wire/keys.h"

namespace imprint {
namespace {

using nlohmann::json;

constexpr const char* kSchema = "imprint.access/1";
constexpr auto kRoles = std::to_array<std::pair<Role, std::string_view>>({{Role::camera, "camera"},
                                                                          {Role::fusion, "fusion"},
                                                                          {Role::viewer, "viewer"},
                                                                          {Role::operator_, "operator"},
                                                                          {Role::engineer, "engineer"}});

// Throws what nlohmann throws; read_schema_list() is the boundary.
Result<IssuedCertificate> certificate_from(const json& entry) {
  const auto role = role_from_name(entry.at("role").get<std::string>());
  if (!role) return pass_on(role.error());
  return IssuedCertificate{.name = entry.at("name"),
                           .common_name = entry.at("common_name"),
                           .serial = entry.at("serial"),
                           .role = *role,
                           .site = entry.at("site"),
                           .line = entry.at("line"),
                           .not_after_ns = entry.at("not_after_ns"),
                           .revoked_ns = entry.at("revoked_ns")};
}

AccessRule camera_rule(const IssuedCertificate& certificate, const Keys& keys) {
  const std::string& id = certificate.name;
  return {
      .name = certificate.common_name,
      .send = {keys.imprint(id), keys.health(id), keys.alive(id), keys.delivery(id), keys.rest(id), keys.service(id)},
      .receive = {keys.trigger(), keys.receipt(id), keys.fusion_alive()},
      .ask = {}};
}

AccessRule person_rule(const IssuedCertificate& certificate, const Keys& keys) {
  AccessRule rule{
      .name = certificate.common_name,
      .send = {},
      .receive = {keys.everything()},
      .ask = {keys.fusion_service("status"), keys.fusion_service("result"), keys.fusion_service("log"),
              keys.service(Keys::kAny, "config"), keys.service(Keys::kAny, "log"), keys.service(Keys::kAny, "crop"),
              keys.service(Keys::kAny, "firmware"), keys.service(Keys::kAny, "bundle")}};
  if (certificate.role == Role::viewer) return rule;
  rule.send.push_back(keys.trigger());
  rule.ask.push_back(keys.fusion_service("acknowledge"));
  if (certificate.role == Role::engineer) {
    rule.ask.push_back(keys.service(Keys::kAny, "configure"));
    rule.ask.push_back(keys.service(Keys::kAny, "update"));
  }
  return rule;
}

}  // namespace

json to_json(const IssuedCertificate& certificate) {
  return {{"name", certificate.name},
          {"common_name", certificate.common_name},
          {"serial", certificate.serial},
          {"role", role_name(certificate.role)},
          {"site", certificate.site},
          {"line", certificate.line},
          {"not_after", utc_text(certificate.not_after_ns)},
          {"not_after_ns", certificate.not_after_ns},
          {"revoked_ns", certificate.revoked_ns}};
}

std::string_view role_name(Role role) {
  return std::ranges::find(kRoles, role, &std::pair<Role, std::string_view>::first)->second;
}

Result<Role> role_from_name(std::string_view name) {
  const auto found = std::ranges::find(kRoles, name, &std::pair<Role, std::string_view>::second);
  if (found != kRoles.end()) return found->first;
  return invalid_input("role: expected camera, fusion, viewer, operator or engineer, found \"{}\"", name);
}

const IssuedCertificate* AccessList::find_common_name(std::string_view common_name) const {
  const auto found = std::ranges::find(certificates, common_name, &IssuedCertificate::common_name);
  return found == certificates.end() ? nullptr : &*found;
}

Result<AccessList> read_access_list(const std::filesystem::path& path) {
  AccessList list;
  const auto read = read_schema_list(path, kSchema, "an access list as `imprint certs` writes it",
                                     [&](const json& document) -> Result<void> {
                                       list.plant = document.at("plant").get<std::string>();
                                       for (const json& entry : document.at("certificates")) {
                                         auto certificate = certificate_from(entry);
                                         if (!certificate) return pass_on(certificate.error());
                                         list.certificates.push_back(std::move(*certificate));
                                       }
                                       return {};
                                     });
  if (!read) return pass_on(read.error());
  return list;
}

Result<void> write_access_list(const std::filesystem::path& path, const AccessList& list) {
  json certificates = json::array();
  for (const IssuedCertificate& certificate : list.certificates) certificates.push_back(to_json(certificate));
  const json document = {{"schema", kSchema}, {"plant", list.plant}, {"certificates", std::move(certificates)}};
  return write_file_atomically(path, document.dump(1) + "\n");
}

Result<std::vector<AccessRule>> access_rules(const AccessList& list) {
  std::vector<AccessRule> rules;
  for (const IssuedCertificate& certificate : list.certificates) {
    if (certificate.revoked_ns != 0) continue;
    if (certificate.role == Role::fusion) {
      const std::vector<std::string> all = {"imprint/" + certificate.site + "/**"};
      rules.push_back({.name = certificate.common_name, .send = all, .receive = all, .ask = all});
      continue;
    }
    const auto keys = Keys::of(certificate.site, certificate.line);
    if (!keys) return invalid_input("certificate {}: {}", certificate.name, keys.error().message);
    rules.push_back(certificate.role == Role::camera ? camera_rule(certificate, *keys)
                                                     : person_rule(certificate, *keys));
  }
  return rules;
}

}  // namespace imprint
