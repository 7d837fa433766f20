#include "delivery.pb.h"
#include "lib/wire/keys.h"
#include "lib/wire/message_bytes.h"
#include "lib/wire/wire.h"
#include "lib/wire/wire_text.h"

namespace imprint {
namespace {

constexpr std::uint32_t kSchemaVersion = 1;
constexpr std::size_t kMaxBytes = 4096;
constexpr std::size_t kMaxReasonBytes = 240;

}  // namespace

std::vector<std::uint8_t> encode_receipt(const Receipt& receipt) {
  v1::Receipt message;
  message.set_schema_version(kSchemaVersion);
  message.set_camera_id(wire_line(receipt.camera_id, kMaxIdBytes));
  message.set_boot_id(receipt.boot_id);
  message.set_sequence(receipt.sequence);
  message.set_refused(wire_line(receipt.refused, kMaxReasonBytes));
  return bytes_of(message);
}

Result<Receipt> decode_receipt(std::span<const std::uint8_t> bytes) {
  const auto message = parse_message<v1::Receipt>(bytes, kMaxBytes);
  if (!message) return invalid_input("receipt: {}", message.error().message);
  if (auto checked = check_id("camera", message->camera_id()); !checked)
    return invalid_input("receipt: {}", checked.error().message);
  return Receipt{message->camera_id(), message->boot_id(), message->sequence(), message->refused()};
}

std::vector<std::uint8_t> encode_delivery(const Delivery& delivery) {
  v1::Delivery message;
  message.set_schema_version(kSchemaVersion);
  message.set_camera_id(wire_line(delivery.camera_id, kMaxIdBytes));
  message.set_time_ns(delivery.time_ns);
  message.set_boot_id(delivery.boot_id);
  message.set_sequence(delivery.sequence);
  message.set_oldest_waiting(delivery.oldest_waiting);
  message.set_waiting(delivery.waiting);
  message.set_waiting_bytes(delivery.waiting_bytes);
  message.set_discarded(delivery.discarded);
  message.set_refused(delivery.refused);
  message.set_fault(wire_line(delivery.fault, kMaxReasonBytes));
  return bytes_of(message);
}

Result<Delivery> decode_delivery(std::span<const std::uint8_t> bytes) {
  const auto message = parse_message<v1::Delivery>(bytes, kMaxBytes);
  if (!message) return invalid_input("delivery: {}", message.error().message);
  if (auto checked = check_id("camera", message->camera_id()); !checked)
    return invalid_input("delivery: {}", checked.error().message);
  Delivery delivery;
  delivery.camera_id = message->camera_id();
  delivery.time_ns = message->time_ns();
  delivery.boot_id = message->boot_id();
  delivery.sequence = message->sequence();
  delivery.oldest_waiting = message->oldest_waiting();
  delivery.waiting = message->waiting();
  delivery.waiting_bytes = message->waiting_bytes();
  delivery.discarded = message->discarded();
  delivery.refused = message->refused();
  delivery.fault = message->fault();
  return delivery;
}

std::vector<std::uint8_t> encode_rest(const Rest& rest) {
  v1::Rest message;
  message.set_schema_version(kSchemaVersion);
  message.set_camera_id(wire_line(rest.camera_id, kMaxIdBytes));
  message.set_time_ns(rest.time_ns);
  return bytes_of(message);
}

Result<Rest> decode_rest(std::span<const std::uint8_t> bytes) {
  const auto message = parse_message<v1::Rest>(bytes, kMaxBytes);
  if (!message) return invalid_input("rest: {}", message.error().message);
  if (auto checked = check_id("camera", message->camera_id()); !checked)
    return invalid_input("rest: {}", checked.error().message);
  return Rest{message->camera_id(), message->time_ns()};
}

std::vector<std::uint8_t> encode_clock_question(const ClockQuestion& question) {
  v1::ClockQuestion message;
  message.set_schema_version(kSchemaVersion);
  message.set_offset_known(question.offset_ns.has_value());
  message.set_offset_ns(question.offset_ns.value_or(0));
  return bytes_of(message);
}

Result<ClockQuestion> decode_clock_question(std::span<const std::uint8_t> bytes) {
  const auto message = parse_message<v1::ClockQuestion>(bytes, kMaxBytes);
  if (!message) return invalid_input("clock question: {}", message.error().message);
  return ClockQuestion{message->offset_known() ? std::optional<std::int64_t>(message->offset_ns()) : std::nullopt};
}

std::vector<std::uint8_t> encode_clock_reading(const ClockReading& reading) {
  v1::ClockReading message;
  message.set_schema_version(kSchemaVersion);
  message.set_received_ns(reading.received_ns);
  message.set_sent_ns(reading.sent_ns);
  return bytes_of(message);
}

Result<ClockReading> decode_clock_reading(std::span<const std::uint8_t> bytes) {
  const auto message = parse_message<v1::ClockReading>(bytes, kMaxBytes);
  if (!message) return invalid_input("clock reading: {}", message.error().message);
  return ClockReading{message->received_ns(), message->sent_ns()};
}

}  // namespace imprint
