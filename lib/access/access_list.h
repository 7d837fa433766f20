#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "lib/result/result.h"
#include "lib/transport/transport.h"

namespace imprint {

/// What somebody is to the plant: a camera's board, a fusion node, or a person with one of three roles, each of which
/// may do what the one before it may: a viewer sees everything, an operator also triggers and acknowledges, an engineer
/// also changes settings.
enum class Role { camera, fusion, viewer, operator_, engineer };

std::string_view role_name(Role role);
/// Fails (invalid_input) naming those there are.
Result<Role> role_from_name(std::string_view name);

/// A certificate that the plant's authority has signed.
struct IssuedCertificate {
  std::string name;         ///< of a camera the camera's id
  std::string common_name;  ///< the name with a part of the serial number: no two certificates share it
  std::string serial;       ///< hexadecimal
  Role role = Role::viewer;
  std::string site;               ///< of a fusion node: of all its site
  std::string line;               ///< empty for a fusion node
  std::int64_t not_after_ns = 0;  ///< since the Unix epoch
  std::int64_t revoked_ns = 0;    ///< 0: it is not
};

/// As it stands in `access.json`.
nlohmann::json to_json(const IssuedCertificate& certificate);

/// All certificates of a plant, and so who may do what: `access.json`. Holds no secret; a router obeys the copy it has.
struct AccessList {
  std::string plant;
  std::vector<IssuedCertificate> certificates;

  [[nodiscard]] const IssuedCertificate* find_common_name(std::string_view common_name) const;
};

Result<AccessList> read_access_list(const std::filesystem::path& path);
Result<void> write_access_list(const std::filesystem::path& path, const AccessList& list);

/// What the holder of each certificate that is not revoked may do at a router: a camera sends as itself alone and reads
/// only triggers, its own receipts and whether fusion is there. Fails (invalid_input) on a site or line that is no id.
Result<std::vector<AccessRule>> access_rules(const AccessList& list);

}  // namespace imprint
