#include "lib/access/authority.h"

#include <algorithm>

#include <catch2/catch.hpp>

#include "lib/config/atomic_file.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

CertificateRequest request_of(const std::string& name, Role role = Role::camera) {
  CertificateRequest request;
  request.name = name;
  request.role = role;
  if (role == Role::fusion) request.hosts = {"fusion.plant", "10.0.0.5"};
  return request;
}

struct Plant {
  TemporaryFolder folder;
  Plant() { REQUIRE(Authority::create(folder / "certs", "forge", 100)); }
  [[nodiscard]] Authority authority() const { return *Authority::open(folder / "certs"); }
};

AccessRule rule_of(const Authority& authority, const IssuedCertificate& certificate) {
  const auto rules = access_rules(authority.list());
  REQUIRE(rules);
  const auto found = std::ranges::find(*rules, certificate.common_name, &AccessRule::name);
  REQUIRE(found != rules->end());
  return *found;
}

bool holds(const std::vector<std::string>& keys, const std::string& key) {
  return std::ranges::find(keys, key) != keys.end();
}

}  // namespace

TEST_CASE("authority: what it issues is in the folder of the board, the key for its owner alone") {
  const Plant plant;
  Authority authority = plant.authority();
  const auto issued = authority.issue(request_of("cam1"));
  REQUIRE(issued);
  const auto folder = authority.folder_of("cam1");
  REQUIRE(read_file(folder / "cert.pem")->starts_with("-----BEGIN CERTIFICATE-----"));
  REQUIRE(*read_file(folder / "ca.pem") == *read_file(plant.folder / "certs" / "ca.pem"));
  const auto permissions = std::filesystem::status(folder / "key.pem").permissions();
  REQUIRE((permissions & (std::filesystem::perms::group_all | std::filesystem::perms::others_all)) ==
          std::filesystem::perms::none);
  REQUIRE(plant.authority().list().find_common_name(issued->common_name)->serial == issued->serial);
}

TEST_CASE("authority: a name has one valid certificate unless it is renewed, and no two share a common name") {
  const Plant plant;
  Authority authority = plant.authority();
  const auto first = authority.issue(request_of("cam1"));
  REQUIRE(first);
  REQUIRE_FALSE(authority.issue(request_of("cam1")));
  CertificateRequest again = request_of("cam1");
  again.renew = true;
  const auto second = authority.issue(again);
  REQUIRE(second);
  REQUIRE(second->common_name != first->common_name);
  REQUIRE(*authority.revoke("cam1", first->serial) == 1);
  REQUIRE(access_rules(authority.list())->size() == 1);
  REQUIRE(access_rules(authority.list())->front().name == second->common_name);
}

TEST_CASE("authority: revoked, a certificate has no rule and its name can be issued anew") {
  const Plant plant;
  Authority authority = plant.authority();
  REQUIRE(authority.issue(request_of("cam1")));
  REQUIRE(authority.revoke("cam1", ""));
  REQUIRE_FALSE(authority.revoke("cam1", ""));
  REQUIRE(access_rules(authority.list())->empty());
  REQUIRE(authority.issue(request_of("cam1")));
}

TEST_CASE("authority: a second one in the folder, a bad name, a fusion node without a host are refused") {
  const Plant plant;
  REQUIRE_FALSE(Authority::create(plant.folder / "certs", "forge", 100));
  REQUIRE_FALSE(Authority::open(plant.folder / "elsewhere"));
  Authority authority = plant.authority();
  for (const std::string& name : {std::string("a/b"), std::string("*"), std::string(), std::string(49, 'a')})
    REQUIRE_FALSE(authority.issue(request_of(name)));
  CertificateRequest fusion = request_of("fusion", Role::fusion);
  fusion.hosts.clear();
  REQUIRE_FALSE(authority.issue(fusion));
  fusion.hosts = {"a,DNS:b"};  // would slip in a second name
  REQUIRE_FALSE(authority.issue(fusion));
  REQUIRE(authority.list().certificates.empty());
}

TEST_CASE("access: a camera sends under its own name alone and reads nobody's imprints") {
  const Plant plant;
  Authority authority = plant.authority();
  const AccessRule rule = rule_of(authority, *authority.issue(request_of("cam1")));
  for (const std::string& key : rule.send) REQUIRE(key.starts_with("imprint/plant/L1/v1/cam/cam1/"));
  REQUIRE(holds(rule.receive, "imprint/plant/L1/v1/trigger"));
  REQUIRE(holds(rule.receive, "imprint/plant/L1/v1/cam/cam1/receipt"));
  REQUIRE(
      std::ranges::none_of(rule.receive, [](const std::string& key) { return key.find('*') != std::string::npos; }));
  REQUIRE(rule.ask.empty());
}

TEST_CASE("access: viewers send nothing, operators trigger, engineers configure and update boards") {
  const Plant plant;
  Authority authority = plant.authority();
  const std::string trigger = "imprint/plant/L1/v1/trigger";
  const std::string configure = "imprint/plant/L1/v1/cam/*/service/configure";
  const std::string update = "imprint/plant/L1/v1/cam/*/service/update";
  const AccessRule viewer = rule_of(authority, *authority.issue(request_of("v", Role::viewer)));
  REQUIRE(viewer.send.empty());
  REQUIRE(holds(viewer.ask, "imprint/plant/L1/v1/cam/*/service/firmware"));
  REQUIRE_FALSE(holds(viewer.ask, configure));
  const AccessRule operating = rule_of(authority, *authority.issue(request_of("o", Role::operator_)));
  REQUIRE(operating.send == std::vector{trigger});
  REQUIRE_FALSE(holds(operating.ask, configure));
  REQUIRE_FALSE(holds(operating.ask, update));
  const AccessRule engineer = rule_of(authority, *authority.issue(request_of("e", Role::engineer)));
  REQUIRE(holds(engineer.ask, configure));
  REQUIRE(holds(engineer.ask, update));
}

TEST_CASE("access: a list that is damaged or of another kind is an error that names the file") {
  const TemporaryFolder folder;
  for (const char* text : {"", "[]", "{}", R"({"schema": "imprint.access/2"})",
                           R"({"schema": "imprint.access/1", "plant": "p", "certificates": [{"role": "king"}]})",
                           R"({"schema": "imprint.access/1", "plant": 1, "certificates": 2})"}) {
    REQUIRE(write_file_atomically(folder / "access.json", text));
    const auto list = read_access_list(folder / "access.json");
    REQUIRE_FALSE(list);
    REQUIRE(list.error().message.find("access.json") != std::string::npos);
  }
}

TEST_CASE("endpoints: TLS wants an identity, plain ones stay on this machine unless the config says insecure") {
  ZenohConfig config;
  config.listen = {"tcp/127.0.0.1:7447", "tcp/localhost:7447", "tcp/[::1]:7447"};
  REQUIRE(check_zenoh(config));
  for (const char* endpoint : {"tcp/0.0.0.0:7447", "udp/10.0.0.5:7447", "tcp/[::]:7447", "tcp/fusion.plant:7447"}) {
    config.listen = {endpoint};
    config.insecure = false;
    REQUIRE_FALSE(check_zenoh(config));
    config.insecure = true;
    REQUIRE(check_zenoh(config));
  }
  config.listen = {"tls/0.0.0.0:7447"};
  REQUIRE_FALSE(check_zenoh(config));
  const Plant plant;
  Authority authority = plant.authority();
  REQUIRE(authority.issue(request_of("fusion", Role::fusion)));
  config.identity = authority.folder_of("fusion");
  REQUIRE(check_zenoh(config));
  std::filesystem::remove(config.identity / "key.pem");
  const auto checked = check_zenoh(config);
  REQUIRE_FALSE(checked);
  REQUIRE(checked.error().message.find("key.pem") != std::string::npos);
}

}  // namespace imprint
