#pragma once

#include <cstdint>

#include "rust/cxx.h"

/// What the Rust side calls. Zenoh calls from its own threads, several at once if it likes, and perhaps
/// once more after the undeclare: an implementation owns its state and its methods are thread-safe.
/// An exception out of one of them becomes a line on stderr (an error reply for a query), nothing worse.
namespace imprint::bridge {

struct Request;  // opaque Rust type

struct SampleHandler {
  virtual ~SampleHandler() = default;
  virtual void on_sample(rust::Str key, rust::Slice<const std::uint8_t> payload) const = 0;
  virtual void on_miss(rust::Str source, std::uint32_t count) const = 0;
};

struct LivenessHandler {
  virtual ~LivenessHandler() = default;
  virtual void on_change(rust::Str key, bool alive) const = 0;
};

/// Who connects to a session, and what is refused to whom.
struct PeerHandler {
  virtual ~PeerHandler() = default;
  /// `name`: the common name of its certificate, empty without one; `id`: of the other session.
  virtual void on_link(bool opened, rust::Str id, rust::Str name, rust::Str address) const = 0;
  /// A session tried what its rules do not allow: `action` as Zenoh names it, e.g. "Put".
  virtual void on_denied(rust::Str id, rust::Str action, rust::Str key) const = 0;
  /// A connection ended in its TLS handshake.
  virtual void on_handshake_refused(rust::Str reason) const = 0;
  /// A connection of this program's own did.
  virtual void on_not_let_in(rust::Str endpoint, rust::Str reason) const = 0;
};

struct RequestHandler {
  virtual ~RequestHandler() = default;
  virtual void on_request(rust::Box<Request> request) const = 0;
};

}  // namespace imprint::bridge
