#include "fusion/serve/sign_in.h"

#include <array>

#include <openssl/rand.h>

namespace imprint {
namespace {

constexpr std::size_t kTokenBytes = 32;
constexpr std::size_t kMaxSessions = 1024;
constexpr std::size_t kMaxSources = 4096;

// Empty when there are no random numbers: then nobody is let in.
std::string new_token() {
  std::array<unsigned char, kTokenBytes> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) return {};
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

}  // namespace

SignIn::SignIn(UserList users)
    : users_(std::move(users)), nobodys_hash_(hash_password("a password of nobody").value_or("")) {}

SignIn::Answer SignIn::sign_in(const std::string& name, const std::string& password, const std::string& address,
                               Time now) {
  const std::string by_name = "name " + name;
  const std::string by_address = "address " + address;
  if (too_many(by_name, now) || too_many(by_address, now))
    return {.outcome = Outcome::too_many, .token = {}, .visitor = {}};
  const User* user = users_.find(name);
  const bool right = password_matches(password, user != nullptr ? user->hash : nobodys_hash_) && user != nullptr;
  const std::string token = right ? new_token() : "";
  if (token.empty()) {
    note_failure(by_name, now);
    note_failure(by_address, now);
    return {};
  }
  const std::lock_guard lock(mutex_);
  failures_.erase(by_name);
  std::erase_if(sessions_, [&](const auto& session) { return session.second.until <= now; });
  if (sessions_.size() >= kMaxSessions) sessions_.clear();  // somebody who knows a password floods: all sign in anew
  const Visitor visitor{user->name, user->role};
  sessions_[token] = {visitor, now + kSignedInFor};
  return {Outcome::welcome, token, visitor};
}

void SignIn::sign_out(const std::string& token) {
  const std::lock_guard lock(mutex_);
  sessions_.erase(token);
}

std::optional<Visitor> SignIn::who(const std::string& token, Time now) const {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(token);
  if (found == sessions_.end() || found->second.until <= now) return std::nullopt;
  return found->second.visitor;
}

bool SignIn::too_many(const std::string& source, Time now) {
  const std::lock_guard lock(mutex_);
  const auto found = failures_.find(source);
  if (found == failures_.end()) return false;
  if (now - found->second.last >= kFailureMemory)
    failures_.erase(found);
  else
    return found->second.count >= kMaxFailures;
  return false;
}

void SignIn::note_failure(const std::string& source, Time now) {
  const std::lock_guard lock(mutex_);
  if (failures_.size() >= kMaxSources)
    std::erase_if(failures_, [&](const auto& entry) { return now - entry.second.last >= kFailureMemory; });
  if (failures_.size() >= kMaxSources && !failures_.contains(source)) return;
  Failures& failures = failures_[source];
  ++failures.count;
  failures.last = now;
}

}  // namespace imprint
