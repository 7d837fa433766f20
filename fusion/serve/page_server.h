#pragma once

#include <memory>
#include <string>

#include "fusion/serve/audit_log.h"
#include "fusion/serve/line_board.h"
#include "fusion/serve/line_control.h"
#include "fusion/store/session_store.h"
#include "lib/result/result.h"

namespace imprint {

struct PageConfig {
  std::string address = "127.0.0.1";  // this machine only; "0.0.0.0": the whole network, with users and over HTTPS
  int port = 8080;                    // 0: any free one
  std::filesystem::path users{};      // who may sign in: users.json of `imprint users`; empty: everybody here operates
  std::filesystem::path identity{};   // folder with the certificate of HTTPS, as zenoh.identity; empty: plain HTTP
  bool insecure = false;              // beyond this machine without users or HTTPS
  std::filesystem::path audit{};      // every change through the page, a JSON line each; empty: none are kept

  [[nodiscard]] bool is_local() const;

  [[nodiscard]] Result<void> validate() const;
};

/// The page of the line and its API (docs/configuration.md). Beyond this machine over HTTPS with the node's own
/// certificate. Who reads needs to be signed in where there are users; who triggers or acknowledges, to be an operator.
class PageServer {
 public:
  /// Serves until destroyed; `board`, `store` and `control` must outlive it. Fails (job_failed) when the port is taken,
  /// (invalid_input) when the users or the certificate cannot be read.
  static Result<std::unique_ptr<PageServer>> start(const PageConfig& config, LineBoard& board, SessionStore& store,
                                                   LineControl& control);
  virtual ~PageServer() = default;

  [[nodiscard]] virtual int port() const = 0;
};

}  // namespace imprint
