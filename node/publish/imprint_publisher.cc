#include "node/publish/imprint_publisher.h"

#include <random>

namespace imprint {
namespace {

constexpr std::size_t kImprintHistory = 256;  // 1 MB: what a fusion node that was away can still get
constexpr std::size_t kMaxErrorBytes = 80;

// Not in the middle of a UTF-8 character.
void cut(std::string& text, std::size_t max_bytes) {
  if (text.size() <= max_bytes) return;
  while (max_bytes > 0 && (static_cast<unsigned char>(text[max_bytes]) & 0xC0U) == 0x80U) --max_bytes;
  text.resize(max_bytes);
}

}  // namespace

std::uint64_t make_boot_id() {
  std::random_device random;
  std::uint64_t id = 0;
  while (id == 0) id = (static_cast<std::uint64_t>(random()) << 32U) | random();
  return id;
}

Result<ImprintPublisher> ImprintPublisher::open(Transport& transport, const Keys& keys, const std::string& camera_id,
                                                std::uint64_t boot_id) {
  auto imprints = transport.publish(keys.imprint(camera_id), {.traffic = Traffic::imprint, .history = kImprintHistory});
  if (!imprints) return pass_on(imprints.error());
  auto health = transport.publish(keys.health(camera_id), {.traffic = Traffic::health, .history = 0});
  if (!health) return pass_on(health.error());
  return ImprintPublisher(boot_id, std::move(*imprints), std::move(*health));
}

Result<void> ImprintPublisher::send(Imprint imprint) {
  imprint.boot_id = boot_id_;
  imprint.sequence = ++sequence_;
  return imprints_->put(encode_imprint(imprint));
}

Result<void> ImprintPublisher::send(Health health) {
  health.boot_id = boot_id_;
  health.sequence = sequence_;
  cut(health.last_error, kMaxErrorBytes);
  return health_->put(encode_health(health));
}

}  // namespace imprint
