#pragma once

#include <optional>
#include <string>

#include "fusion/serve/sign_in.h"

namespace httplib {
struct Request;
}

namespace imprint {

/// Who sends a request to the page, and whether the request is the page's own. Without users, which only a page of this
/// machine can be, everybody here is an operator.
class PageAccess {
 public:
  static constexpr const char* kCookie = "imprint";
  /// The page's script sets this header; another site's cannot without being asked.
  static constexpr const char* kOwnHeader = "X-Imprint";

  explicit PageAccess(std::optional<UserList> users);

  [[nodiscard]] bool has_users() const { return sign_in_.has_value(); }
  [[nodiscard]] SignIn* sign_in() { return sign_in_ ? &*sign_in_ : nullptr; }

  [[nodiscard]] std::optional<Visitor> visitor(const httplib::Request& request) const;
  /// Whether the request comes from the page itself, or from a program that names itself.
  [[nodiscard]] bool is_own(const httplib::Request& request) const;
  [[nodiscard]] static std::string token_of(const httplib::Request& request);

 private:
  std::optional<SignIn> sign_in_;
};

}  // namespace imprint
