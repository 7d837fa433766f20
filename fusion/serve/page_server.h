#pragma once

#include <memory>
#include <string>

#include "fusion/serve/line_board.h"
#include "fusion/store/session_store.h"
#include "lib/result/result.h"

namespace imprint {

struct PageConfig {
  std::string address = "127.0.0.1";  // this machine only; "0.0.0.0" shows the page to the whole network
  int port = 8080;                    // 0: any free one

  [[nodiscard]] Result<void> validate() const;
};

/// The page of the line and its API, read only, over HTTP: `/`, `/api/status`, `/api/cameras`, `/api/sessions`,
/// `/api/result/latest`, `/api/result/<session>`, `/healthz` (docs/configuration.md).
class PageServer {
 public:
  /// Serves until destroyed; `board` and `store` must outlive it. Fails (job_failed) when the port is taken.
  static Result<std::unique_ptr<PageServer>> start(const PageConfig& config, const LineBoard& board,
                                                   SessionStore& store);
  virtual ~PageServer() = default;

  [[nodiscard]] virtual int port() const = 0;
};

}  // namespace imprint
