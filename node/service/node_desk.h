#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <toml++/toml.h>

#include "lib/service/document_desk.h"
#include "lib/wire/keys.h"
#include "node/node_config.h"
#include "node/service/board_update.h"
#include "node/service/last_frame.h"
#include "node/service/remote_settings.h"

namespace imprint {

/// What a person may ask of a node from afar, `cam/<id>/service/...`: `config` (the settings in force), `configure`
/// (others, checked, then on trial with the node's next start), `firmware` (the board's image) and `update` (another
/// one), `log`, `crop` of the last frame, `bundle` (all of it for whoever helps). Documents in pieces, one thread,
/// below everything that measures.
class NodeDesk {
 public:
  struct Node {
    const NodeConfig& config;
    const toml::table& own_table;  ///< the config file with --set, without settings from afar
    std::filesystem::path config_file;
    std::function<Result<void>(const NodeConfig&)> check;  ///< whether the node could start with this
    std::string version;
  };

  static Result<std::unique_ptr<NodeDesk>> open(Transport& transport, const Keys& keys, Node node,
                                                RemoteSettings& settings, const LastFrame& frame);
  NodeDesk(const NodeDesk&) = delete;
  NodeDesk& operator=(const NodeDesk&) = delete;

  /// Settings were put on trial: the node is to start anew.
  [[nodiscard]] bool restart_wanted() const { return restart_wanted_; }
  /// Whether fusion has been seen since the start.
  [[nodiscard]] bool fusion_seen() const { return *fusion_seen_; }
  /// Keeps the settings on trial; they have found fusion.
  Result<void> accept_settings();

 private:
  NodeDesk(Node node, RemoteSettings& settings, const LastFrame& frame)
      : node_(std::move(node)),
        settings_(settings),
        frame_(frame),
        board_(node_.config.data_dir),
        fusion_seen_(std::make_shared<std::atomic<bool>>(false)) {}

  Result<Bytes> config_document();
  Result<Bytes> configure(const Parameters& parameters, const Bytes& payload);
  Result<Bytes> bundle();

  Node node_;
  std::mutex settings_mutex_;
  RemoteSettings& settings_;
  const LastFrame& frame_;
  BoardUpdate board_;
  std::shared_ptr<std::atomic<bool>> fusion_seen_;
  std::atomic<bool> restart_wanted_ = false;
  std::unique_ptr<Declaration> fusion_watch_;
  std::unique_ptr<DocumentDesk> desk_;  // last: it calls this
};

}  // namespace imprint
