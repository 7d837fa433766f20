#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fusion/receive/sequence_ledger.h"
#include "fusion/serve/line_board.h"
#include "fusion/store/session_store.h"
#include "lib/imprint/imprint.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"
#include "lib/wire/wire.h"

namespace imprint {

/// Tells each node which of its imprints are on disk, keeps count of what is missing between them, and shows it on the
/// board. One thread at a time.
class DeliveryDesk {
 public:
  /// One camera each; the ledgers begin with what the store holds.
  static Result<DeliveryDesk> open(Transport& transport, const Keys& keys, const std::vector<std::string>& camera_ids,
                                   SessionStore& store, LineBoard& board);

  /// This imprint is on disk, now (`is_new`) or before: its node gets the receipt.
  void stored(const Imprint& imprint, bool is_new);
  /// It can never be stored, and the node need not send it again.
  void refused(const Imprint& imprint, const std::string& why);
  /// What a node says that it holds. An imprint it has discarded raises an alarm that stays until the node restarts.
  void receive(const Delivery& delivery, LineBoard::Time now);
  /// What is missing of a camera, for the words of a result; empty when nothing is.
  [[nodiscard]] std::string missing_of(const std::string& camera_id) const;

 private:
  struct Camera {
    SequenceLedger ledger;
    std::unique_ptr<Publisher> receipts;
    bool had_gap = false;
  };

  explicit DeliveryDesk(LineBoard& board) : board_(&board) {}
  void send(Camera& camera, const Receipt& receipt);
  void show(const std::string& camera_id, Camera& camera);

  LineBoard* board_;
  std::map<std::string, Camera> cameras_;
};

}  // namespace imprint
