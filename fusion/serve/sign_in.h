#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "lib/access/user_list.h"

namespace imprint {

/// Who somebody at the page is.
struct Visitor {
  std::string name;
  Role role = Role::viewer;
};

/// The page's users: checks passwords, keeps who is signed in, slows down who guesses. Safe to use from several
/// threads.
class SignIn {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr int kMaxFailures = 5;  // of a name or an address within kFailureMemory
  static constexpr auto kFailureMemory = std::chrono::minutes(5);
  static constexpr auto kSignedInFor = std::chrono::hours(12);  // a shift and its handing over

  explicit SignIn(UserList users);

  enum class Outcome { welcome, refused, too_many };
  struct Answer {
    Outcome outcome = Outcome::refused;
    std::string token;  ///< what the browser shows from now on; empty unless welcome
    Visitor visitor;
  };
  /// An unknown name takes as long as a wrong password.
  Answer sign_in(const std::string& name, const std::string& password, const std::string& address, Time now);
  void sign_out(const std::string& token);
  [[nodiscard]] std::optional<Visitor> who(const std::string& token, Time now) const;

 private:
  struct Session {
    Visitor visitor;
    Time until;
  };
  struct Failures {
    int count = 0;
    Time last;
  };
  bool too_many(const std::string& source, Time now);
  void note_failure(const std::string& source, Time now);

  const UserList users_;
  const std::string nobodys_hash_;
  mutable std::mutex mutex_;
  std::map<std::string, Session> sessions_;   // by token
  std::map<std::string, Failures> failures_;  // by name and by address
};

}  // namespace imprint
