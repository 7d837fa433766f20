#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

using Bytes = std::vector<std::uint8_t>;

/// One message as it arrived.
struct Sample {
  std::string key;
  Bytes payload;
};

/// Called on a thread of the transport: queue the work and return, never block or call the transport from it.
using SampleCallback = std::function<void(const Sample&)>;
using MissCallback = std::function<void(std::string_view source, std::uint32_t count)>;
using LivenessCallback = std::function<void(std::string_view key, bool alive)>;

/// A request that waits for its answer; may be answered later and from any thread, at most once. Dropped
/// unanswered, the asking side gets nothing from here.
class Query {
 public:
  virtual ~Query() = default;
  [[nodiscard]] virtual std::string key() const = 0;
  [[nodiscard]] virtual std::string parameters() const = 0;
  [[nodiscard]] virtual Bytes payload() const = 0;
  virtual Result<void> reply(std::span<const std::uint8_t> payload) = 0;
  virtual Result<void> reply_error(std::string_view message) = 0;
};
using QueryCallback = std::function<void(std::shared_ptr<Query>)>;

/// Each has its own priority on the link; `backlog`: imprints sent again.
enum class Traffic { imprint, backlog, health, command, bulk };

/// Sends on one key. With `history` the last samples are kept for subscribers that come late or lost some.
class Publisher {
 public:
  virtual ~Publisher() = default;
  virtual Result<void> put(std::span<const std::uint8_t> payload) = 0;
};

/// Lives as long as what it stands for (a subscription, a liveliness token, a queryable).
class Declaration {
 public:
  virtual ~Declaration() = default;
};

struct PublisherOptions {
  Traffic traffic = Traffic::imprint;
  std::size_t history = 0;  ///< samples kept for late or lossy subscribers; 0: none
};
struct SubscriberOptions {
  std::size_t history = 0;  ///< samples to ask for on start; recovery of missed ones is on when > 0
};

/// A connection to the plant's key space. Key expressions as in Zenoh (`*`, `**`).
class Transport {
 public:
  virtual ~Transport() = default;
  virtual Result<std::unique_ptr<Publisher>> publish(const std::string& key, PublisherOptions options) = 0;
  virtual Result<std::unique_ptr<Declaration>> subscribe(const std::string& key, SubscriberOptions options,
                                                         SampleCallback on_sample, MissCallback on_miss = {}) = 0;
  virtual Result<std::unique_ptr<Declaration>> answer(const std::string& key, QueryCallback on_query) = 0;
  virtual Result<std::unique_ptr<Declaration>> announce(const std::string& key) = 0;  ///< liveliness token
  virtual Result<std::unique_ptr<Declaration>> watch_liveness(const std::string& key, LivenessCallback on_change) = 0;
  /// All replies to a query within the timeout; an error reply is an Error. Replies travel as the query does. Blocks:
  /// never from a callback.
  virtual Result<std::vector<Sample>> get(const std::string& selector, std::span<const std::uint8_t> payload,
                                          std::chrono::milliseconds timeout, Traffic traffic) = 0;
  Result<std::vector<Sample>> get(const std::string& selector, std::span<const std::uint8_t> payload,
                                  std::chrono::milliseconds timeout) {
    return get(selector, payload, timeout, Traffic::command);
  }
};

/// What the holder of a certificate may do at a router. Key expressions; nothing else is let through.
struct AccessRule {
  std::string name;                    ///< common name of the certificate
  std::vector<std::string> send{};     ///< may publish, answer queries and announce itself on these
  std::vector<std::string> receive{};  ///< may subscribe to these and see who announces itself there
  std::vector<std::string> ask{};      ///< may send queries to these
};

/// What a session tells of those who connect to it, and of who does not let it in.
struct PeerNotice {
  enum class Kind { connected, gone, denied, handshake_refused, not_let_in };
  Kind kind = Kind::connected;
  std::string name;    ///< common name of its certificate; empty: it has none, or it is not known
  std::string detail;  ///< its address; of `denied` what it tried; of `handshake_refused` why;
                       ///< of `not_let_in` (the TLS handshake of our own connection) where and why
};
/// Called on a thread of the transport, perhaps once more after the transport is closed; never blocks.
using PeerCallback = std::function<void(const PeerNotice&)>;

struct ZenohConfig {
  std::vector<std::string> connect{};  ///< endpoints to reach, e.g. "tls/10.0.0.5:7447"; kept trying for ever
  std::vector<std::string> listen{};   ///< endpoints to open; none by default
  bool router = false;                 ///< route for others (the fusion node)
  bool tool = false;                   ///< a command for a person: needs a router there, and says so when there is none
  /// Folder with ca.pem, cert.pem and key.pem: who this program is to others over TLS, and who signs for them.
  std::filesystem::path identity{};
  bool insecure = false;  ///< tcp and udp beyond this machine too: whoever reaches the router can be any camera
  std::vector<AccessRule> access{};  ///< of a router that listens on TLS; empty: whoever has a certificate may do all
  PeerCallback on_peer{};
};

/// Whether the endpoints are well-formed and as safe as the config wants them: over a network only TLS, with an
/// identity whose three files can be read, unless `insecure`. Fails (invalid_input) naming endpoint or file.
Result<void> check_zenoh(const ZenohConfig& config);

/// Opens at once and connects when the other side is there, now or later; a tool instead fails (job_failed)
/// when no router is reached within 3 s. A router carries between itself, nodes and tools, but not from one
/// node (neither router nor tool) to another: Zenoh takes those to be connected directly.
/// Fails naming the endpoint: invalid_input for one that is malformed, job_failed for one that cannot be opened.
Result<std::unique_ptr<Transport>> open_zenoh(const ZenohConfig& config);

/// The twin for tests: every transport opened on one bus sees the others, in this process.
class MemoryBus;
std::shared_ptr<MemoryBus> make_memory_bus();
std::unique_ptr<Transport> open_memory(std::shared_ptr<MemoryBus> bus);

}  // namespace imprint
