#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"
#include "lib/wire/wire.h"

namespace imprint {

/// A number that no other start of a node has: what tells a restarted node's imprints from those before.
std::uint64_t make_boot_id();

/// Sends one camera's imprints and health. Counts the imprints of this start; the last ones stay in the transport's
/// history for a fusion node that was away.
class ImprintPublisher {
 public:
  static Result<ImprintPublisher> open(Transport& transport, const Keys& keys, const std::string& camera_id,
                                       std::uint64_t boot_id);

  /// Stamps boot and sequence and sends.
  Result<void> send(Imprint imprint);
  /// Stamps boot and sequence of the last imprint and sends; `last_error` is cut to the 80 characters of the wire.
  Result<void> send(Health health);

 private:
  ImprintPublisher(std::uint64_t boot_id, std::unique_ptr<Publisher> imprints, std::unique_ptr<Publisher> health)
      : boot_id_(boot_id), imprints_(std::move(imprints)), health_(std::move(health)) {}

  std::uint64_t boot_id_;
  std::uint64_t sequence_ = 0;
  std::unique_ptr<Publisher> imprints_;
  std::unique_ptr<Publisher> health_;
};

}  // namespace imprint
