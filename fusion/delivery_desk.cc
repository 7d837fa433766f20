#include "fusion/delivery_desk.h"

#include "lib/log/log.h"

namespace imprint {
namespace {

constexpr int kStartsRecalled = 4;  // of each node, when this program begins

std::string gaps_text(const SequenceLedger& ledger) {
  std::vector<SequenceLedger::Range> ranges;
  for (const auto& gap : ledger.gaps()) ranges.push_back(gap.missing);
  return ranges_text(ranges);
}

}  // namespace

Result<DeliveryDesk> DeliveryDesk::open(Transport& transport, const Keys& keys,
                                        const std::vector<std::string>& camera_ids, SessionStore& store,
                                        LineBoard& board) {
  DeliveryDesk desk(board);
  for (const std::string& id : camera_ids) {
    auto receipts = transport.publish(keys.receipt(id), {.traffic = Traffic::imprint, .history = 0});
    if (!receipts) return pass_on(receipts.error());
    Camera& camera = desk.cameras_[id];
    camera.receipts = std::move(*receipts);
    const auto numbers = store.sequences(id, kStartsRecalled);
    if (!numbers) return pass_on(numbers.error());
    for (const auto& [boot_id, sequence] : *numbers) camera.ledger.add(boot_id, sequence);
    camera.had_gap = camera.ledger.missing() > 0;
    desk.show(id, camera);
  }
  return desk;
}

void DeliveryDesk::stored(const Imprint& imprint, bool is_new) {
  const auto found = cameras_.find(imprint.camera_id);
  if (found == cameras_.end()) return;
  Camera& camera = found->second;
  send(camera, {imprint.camera_id, imprint.boot_id, imprint.sequence, {}});
  if (!is_new) return;
  const Place place = camera.ledger.add(imprint.boot_id, imprint.sequence);
  if (place == Place::belated) board_->count("reordered");
  show(imprint.camera_id, camera);
}

void DeliveryDesk::refused(const Imprint& imprint, const std::string& why) {
  const auto found = cameras_.find(imprint.camera_id);
  if (found == cameras_.end()) return;
  found->second.ledger.add(imprint.boot_id, imprint.sequence);  // it will not come in another form
  send(found->second, {imprint.camera_id, imprint.boot_id, imprint.sequence, why});
}

void DeliveryDesk::receive(const Delivery& delivery, LineBoard::Time now) {
  const auto found = cameras_.find(delivery.camera_id);
  if (found == cameras_.end()) return;
  found->second.ledger.announce(delivery.boot_id, delivery.sequence, delivery.oldest_waiting);
  board_->set_delivery(delivery, now);
  board_->set_alarm(
      "discarded_" + delivery.camera_id,
      delivery.discarded == 0
          ? ""
          : fmt::format("camera {}: {} imprint(s) were lost: too many waited in the node, see spool.max_mb",
                        delivery.camera_id, delivery.discarded));
  board_->set_alarm("spool_" + delivery.camera_id, delivery.fault.empty()
                                                       ? ""
                                                       : fmt::format("camera {}: imprints are not kept on disk: {}",
                                                                     delivery.camera_id, delivery.fault));
  show(delivery.camera_id, found->second);
}

std::string DeliveryDesk::missing_of(const std::string& camera_id) const {
  const auto found = cameras_.find(camera_id);
  return found == cameras_.end() ? std::string() : gaps_text(found->second.ledger);
}

void DeliveryDesk::send(Camera& camera, const Receipt& receipt) {
  if (auto sent = camera.receipts->put(encode_receipt(receipt)); !sent) spdlog::warn("{}", sent.error().message);
}

void DeliveryDesk::show(const std::string& camera_id, Camera& camera) {
  const std::uint64_t missing = camera.ledger.missing();
  const std::string text = gaps_text(camera.ledger);
  if (missing > 0 && !camera.had_gap) {
    spdlog::warn("camera {}: imprint(s) number {} are missing", camera_id, text);
  } else if (missing == 0 && camera.had_gap) {
    spdlog::info("camera {}: no imprint is missing any more", camera_id);
  }
  camera.had_gap = missing > 0;
  board_->set_missing(camera_id, missing, text);
}

}  // namespace imprint
