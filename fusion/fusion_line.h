#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "fusion/fusion_config.h"
#include "fusion/fusion_service.h"
#include "fusion/history/history_export.h"
#include "fusion/plc_input.h"
#include "fusion/serve/line_board.h"
#include "fusion/serve/line_control.h"
#include "fusion/serve/page_server.h"
#include "fusion/store/session_store.h"
#include "lib/result/result.h"
#include "lib/rig/rig.h"
#include "lib/service/document_desk.h"
#include "lib/transport/transport.h"

namespace imprint {

/// One line as the fusion program runs it: its rig, store, page and inputs, and, while there is a transport, its
/// service. A program may run several, which share nothing but the transport.
class FusionLine {
 public:
  /// Reads the rig. Fails (invalid_input) on what the config names and cannot be used.
  static Result<std::unique_ptr<FusionLine>> read(FusionConfig config);
  FusionLine(const FusionLine&) = delete;
  FusionLine& operator=(const FusionLine&) = delete;
  ~FusionLine() { disconnect(); }

  /// Whether `open` would find or could make a store. Changes nothing.
  [[nodiscard]] Result<void> check() const;
  /// Opens the store, the page and the PLC's input; the copy of the history begins.
  Result<void> open();
  /// Begins to receive and fuse; what `disconnect` ended can begin again on another transport.
  Result<void> connect(Transport& transport);
  void disconnect();

  [[nodiscard]] const FusionConfig& config() const { return config_; }
  [[nodiscard]] std::string name() const { return config_.site + "/" + config_.line; }
  [[nodiscard]] LineBoard& board() { return *board_; }
  /// Of the connected service, as FusionService::turns().
  [[nodiscard]] std::uint64_t turns() const { return service_ ? service_->turns() : 0; }

 private:
  FusionLine(FusionConfig config, Rig rig) : config_(std::move(config)), rig_(std::move(rig)) {}

  FusionConfig config_;
  Rig rig_;
  std::unique_ptr<SessionStore> store_;
  std::unique_ptr<LineBoard> board_;
  std::unique_ptr<HistoryExport> history_;
  LineControl control_;
  std::unique_ptr<PageServer> page_;
  std::unique_ptr<PlcInput> plc_;
  std::optional<FusionService> service_;
  std::unique_ptr<DocumentDesk> desk_;
};

}  // namespace imprint
