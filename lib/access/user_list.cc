#include "lib/access/user_list.h"

#include <algorithm>
#include <memory>

#include <crypt.h>
#include <openssl/crypto.h>
#include <nlohmann/json.hpp>

#include "lib/access/schema_list.h"
#include "lib/config/atomic_file.h"
#include "lib/wire/keys.h"

namespace imprint {
namespace {

using nlohmann::json;

constexpr const char* kSchema = "imprint.users/1";
constexpr const char* kYescrypt = "$y$";

// Throws what nlohmann throws; read_schema_list() is the boundary.
Result<User> user_from(const json& entry) {
  User user{.name = entry.at("name"), .role = Role::viewer, .hash = entry.at("hash")};
  if (auto valid = check_id("user", user.name); !valid) return pass_on(valid.error());
  const auto role = role_from_name(entry.at("role").get<std::string>());
  if (!role) return pass_on(role.error());
  if (*role < Role::viewer) return invalid_input("user {}: expected viewer, operator or engineer", user.name);
  user.role = *role;
  return user;
}

}  // namespace

const User* UserList::find(std::string_view name) const {
  const auto found = std::ranges::find(users, name, &User::name);
  return found == users.end() ? nullptr : &*found;
}

Result<UserList> read_user_list(const std::filesystem::path& path) {
  UserList list;
  const auto read = read_schema_list(path, kSchema, "users as `imprint users` writes them",
                                     [&](const json& document) -> Result<void> {
                                       for (const json& entry : document.at("users")) {
                                         auto user = user_from(entry);
                                         if (!user) return pass_on(user.error());
                                         list.users.push_back(std::move(*user));
                                       }
                                       return {};
                                     });
  if (!read) return pass_on(read.error());
  return list;
}

Result<void> write_user_list(const std::filesystem::path& path, const UserList& list) {
  json users = json::array();
  for (const User& user : list.users)
    users.push_back({{"name", user.name}, {"role", role_name(user.role)}, {"hash", user.hash}});
  const json document = {{"schema", kSchema}, {"users", std::move(users)}};
  if (auto written = write_file_atomically(path, document.dump(1) + "\n"); !written) return written;
  std::error_code failed;
  std::filesystem::permissions(path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write, failed);
  if (failed) return job_failed("{}: cannot be made private: {}", path.string(), failed.message());
  return {};
}

Result<std::string> hash_password(const std::string& password) {
  if (password.size() < kMinPasswordBytes || password.size() > kMaxPasswordBytes)
    return invalid_input("password: expected {} to {} characters, found {}", kMinPasswordBytes, kMaxPasswordBytes,
                         password.size());
  char salt[CRYPT_GENSALT_OUTPUT_SIZE];
  auto data = std::make_unique<crypt_data>();
  if (crypt_gensalt_rn(kYescrypt, 0, nullptr, 0, salt, sizeof salt) == nullptr)
    return job_failed("password: libxcrypt has no yescrypt here");
  const char* hash = crypt_rn(password.c_str(), salt, data.get(), sizeof(crypt_data));
  if (hash == nullptr) return job_failed("password: libxcrypt could not hash it");
  return std::string(hash);
}

bool password_matches(const std::string& password, const std::string& hash) {
  if (password.size() > kMaxPasswordBytes || !hash.starts_with(kYescrypt)) return false;
  auto data = std::make_unique<crypt_data>();
  const char* again = crypt_rn(password.c_str(), hash.c_str(), data.get(), sizeof(crypt_data));
  return again != nullptr && hash.size() == std::string_view(again).size() &&
         CRYPTO_memcmp(again, hash.data(), hash.size()) == 0;
}

}  // namespace imprint
