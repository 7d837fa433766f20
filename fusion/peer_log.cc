#include "fusion/peer_log.h"

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"

namespace imprint {
namespace {

constexpr auto kLogAgain = std::chrono::minutes(1);
constexpr std::size_t kMaxRemembered = 256;

}  // namespace

void PeerLog::note(const PeerNotice& notice) {
  const IssuedCertificate* certificate = list_.find_common_name(notice.name);
  const bool listed = certificate != nullptr && certificate->revoked_ns == 0;
  const std::string name = notice.name.empty() ? "somebody without a certificate" : notice.name;
  switch (notice.kind) {
    case PeerNotice::Kind::connected:
      if (list_.certificates.empty()) return;
      if (listed) {
        const std::string what = fmt::format("{} {} connected", role_name(certificate->role), name);
        if (is_new(what)) spdlog::info("{} from {}", what, notice.detail);
      } else if (certificate != nullptr) {
        refused(
            fmt::format("{} at {}: certificate revoked {}", name, notice.detail, utc_text(certificate->revoked_ns)));
      } else {
        refused(fmt::format("{} at {}: not in the access list", name, notice.detail));
      }
      return;
    case PeerNotice::Kind::gone:
      if (listed && certificate->role == Role::camera) spdlog::info("camera {} gone", name);
      return;
    case PeerNotice::Kind::denied:
      return refused(fmt::format("{}: {}", name, notice.detail));
    case PeerNotice::Kind::handshake_refused:
      return refused("a connection: " + notice.detail);
    case PeerNotice::Kind::not_let_in:
      if (is_new(notice.detail)) spdlog::error("not let in at {}; own certificate {}", notice.detail, own_name_);
      return;
  }
}

void PeerLog::refused(const std::string& what) {
  board_.count("denied");
  if (is_new(what)) spdlog::warn("refused: {}", what);
}

bool PeerLog::is_new(const std::string& what) {
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  if (logged_.size() >= kMaxRemembered) logged_.clear();
  const auto [entry, added] = logged_.try_emplace(what, now);
  if (!added && now - entry->second < kLogAgain) return false;
  entry->second = now;
  return true;
}

}  // namespace imprint
