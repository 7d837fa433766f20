#include "fusion/serve/page_access.h"

#include <httplib.h>

namespace imprint {
namespace {

// A foreign name that leads to this machine (DNS rebinding) must not speak for the page.
bool names_this_machine(const std::string& host) {
  const std::string name = host.starts_with('[') ? host.substr(0, host.find(']') + 1) : host.substr(0, host.find(':'));
  return name == "localhost" || name == "[::1]" || name.starts_with("127.");
}

}  // namespace

PageAccess::PageAccess(std::optional<UserList> users) {
  if (users) sign_in_.emplace(std::move(*users));
}

std::string PageAccess::token_of(const httplib::Request& request) {
  const std::string cookies = request.get_header_value("Cookie");
  const std::string name = std::string(kCookie) + '=';
  for (std::size_t begin = 0; begin < cookies.size();) {
    const std::size_t end = std::min(cookies.find(';', begin), cookies.size());
    const std::size_t first = std::min(cookies.find_first_not_of(' ', begin), end);
    if (cookies.compare(first, name.size(), name) == 0)
      return cookies.substr(first + name.size(), end - first - name.size());
    begin = end + 1;
  }
  return {};
}

std::optional<Visitor> PageAccess::visitor(const httplib::Request& request) const {
  if (!sign_in_) return Visitor{"somebody at this machine", Role::operator_};
  return sign_in_->who(token_of(request), std::chrono::steady_clock::now());
}

bool PageAccess::is_own(const httplib::Request& request) const {
  if (!request.has_header(kOwnHeader)) return false;
  return sign_in_.has_value() || names_this_machine(request.get_header_value("Host"));
}

}  // namespace imprint
