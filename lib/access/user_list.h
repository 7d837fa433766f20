#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "lib/access/access_list.h"
#include "lib/result/result.h"

namespace imprint {

/// Somebody who may sign in at fusion's page.
struct User {
  std::string name;
  Role role = Role::viewer;  ///< viewer, operator or engineer
  std::string hash;          ///< of the password, yescrypt, as libxcrypt writes it
};

/// `users.json`: names, roles and the passwords' hashes.
struct UserList {
  std::vector<User> users;

  [[nodiscard]] const User* find(std::string_view name) const;
};

inline constexpr std::size_t kMinPasswordBytes = 10;
inline constexpr std::size_t kMaxPasswordBytes = 256;

Result<UserList> read_user_list(const std::filesystem::path& path);
/// For its owner alone to read.
Result<void> write_user_list(const std::filesystem::path& path, const UserList& list);

/// yescrypt with a salt of its own, the library's default cost (about 0.1 s). Fails (invalid_input) on a password that
/// is too short or too long.
Result<std::string> hash_password(const std::string& password);
/// False also for a hash that is none.
bool password_matches(const std::string& password, const std::string& hash);

}  // namespace imprint
