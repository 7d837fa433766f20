#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lib/imprint/imprint.h"
#include "lib/result/result.h"

namespace imprint {

/// The most an encoded imprint takes, contract section 4.
inline constexpr std::size_t kMaxImprintBytes = 4096;

/// The protobuf bytes of `imprint.v1.Imprint` (packing: proto/imprint.proto): never more than kMaxImprintBytes,
/// curve points true to 0.002 px, weights to 1/510. Curves too rough for that lose, in this order, the offsets
/// of weight 0, then fineness of the weights, then of the offsets (a warning in the imprint says so).
/// Texts are cut: ids to 64 bytes, `failure` to 240, the first three warnings to 120 each.
/// An imprint that no receiver could use (pose not finite, curves of different lengths) is sent without its
/// curves, `failure` telling why.
std::vector<std::uint8_t> encode_imprint(const Imprint& imprint);

/// Fails (invalid_input) on bytes that are no imprint or carry impossible values; never throws, bounded memory.
/// What it returns is finite, with a rotation for a pose and a unit direction; it has three curves of the same
/// 1 to kImprintStations stations, weights 0 to 1, or none and a `failure`.
Result<Imprint> decode_imprint(std::span<const std::uint8_t> bytes);

struct Trigger {
  std::string session;
  std::uint32_t observation = 0;
  double rotation_deg = 0.0;
  std::int64_t fire_at_ns = 0;              ///< sensor time, since the Unix epoch; 0: at once
  std::uint32_t observations_expected = 0;  ///< of this session; 0: not known
};
std::vector<std::uint8_t> encode_trigger(const Trigger& trigger);
Result<Trigger> decode_trigger(std::span<const std::uint8_t> bytes);

struct Health {
  std::string camera_id;
  std::int64_t time_ns = 0;
  std::uint64_t boot_id = 0;
  std::uint64_t sequence = 0;       ///< of the last imprint
  std::uint64_t frames = 0;         ///< frames taken since start
  std::uint64_t failed_frames = 0;  ///< of which no imprint could be made
  int targets_seen = 0;
  double reprojection_rms_px = 0.0;
  double contrast = 0.0;
  std::string last_error;  ///< one line, cut to 80 bytes; empty when the last frame was good
  std::string version;
  PoseState pose_state = PoseState::tracking;  ///< of the last frame
  // Of the last frame, as in FrameQuality.
  double saturated_fraction = 0.0;
  double blur_px = 0.0;
  double haze_px = 0.0;
  double body_level = 0.0;
  double exposure_us = 0.0;  ///< 0: the frame source does not say
  double gain_db = 0.0;
  std::optional<double> housing_temperature_c{};
  std::optional<double> sensor_temperature_c{};
  std::optional<double> storage_free_mb{};  ///< on the partition where imprints wait
  std::optional<double> clock_offset_s{};   ///< the node's clock minus fusion's, as fusion has told
  std::string exposure_alarm{};        ///< one line, cut to 120 bytes; empty: the forging is held out of saturation
  std::uint64_t dropped_frames = 0;    ///< since start: taken by the camera, never whole at the node
  std::uint64_t capture_restarts = 0;  ///< since start: times the camera was lost and opened anew
  std::string capture_fault{};         ///< one line, cut to 80 bytes; empty: frames come
};
std::vector<std::uint8_t> encode_health(const Health& health);
Result<Health> decode_health(std::span<const std::uint8_t> bytes);

/// From fusion to a node: this imprint is on fusion's disk, or can never be.
struct Receipt {
  std::string camera_id;
  std::uint64_t boot_id = 0;
  std::uint64_t sequence = 0;
  std::string refused;  ///< why it can never be stored, cut to 240 bytes; empty: it is stored
};
std::vector<std::uint8_t> encode_receipt(const Receipt& receipt);
Result<Receipt> decode_receipt(std::span<const std::uint8_t> bytes);

/// What a node still holds for fusion.
struct Delivery {
  std::string camera_id;
  std::int64_t time_ns = 0;
  std::uint64_t boot_id = 0;
  std::uint64_t sequence = 0;        ///< of the last imprint made since this start
  std::uint64_t oldest_waiting = 0;  ///< lowest sequence of this start without a receipt; 0: none
  std::uint32_t waiting = 0;         ///< imprints without a receipt, of all starts
  std::uint64_t waiting_bytes = 0;
  std::uint64_t discarded = 0;  ///< since this start, for want of room, before fusion had them
  std::uint64_t refused = 0;    ///< since this start, by fusion
  std::string fault;            ///< why imprints cannot be kept on disk, cut to 240 bytes; empty: they are
};
std::vector<std::uint8_t> encode_delivery(const Delivery& delivery);
Result<Delivery> decode_delivery(std::span<const std::uint8_t> bytes);

/// A node has seen the forging come to rest, and asks for an observation.
struct Rest {
  std::string camera_id;
  std::int64_t time_ns = 0;  ///< of the look that saw it, by the node's clock
};
std::vector<std::uint8_t> encode_rest(const Rest& rest);
Result<Rest> decode_rest(std::span<const std::uint8_t> bytes);

/// Fusion asks a node for its time.
struct ClockQuestion {
  std::optional<std::int64_t> offset_ns;  ///< node's clock minus fusion's, as measured before
};
std::vector<std::uint8_t> encode_clock_question(const ClockQuestion& question);
Result<ClockQuestion> decode_clock_question(std::span<const std::uint8_t> bytes);

/// The node's answer, times by its clock since the Unix epoch.
struct ClockReading {
  std::int64_t received_ns = 0;  ///< when the question came
  std::int64_t sent_ns = 0;      ///< when the answer left
};
std::vector<std::uint8_t> encode_clock_reading(const ClockReading& reading);
Result<ClockReading> decode_clock_reading(std::span<const std::uint8_t> bytes);

/// A piece of a document that is too long for one message.
struct Chunk {
  std::uint64_t ticket = 0;       ///< of the document
  std::uint32_t total_bytes = 0;  ///< of the document
  std::uint32_t offset = 0;       ///< of this piece
  std::vector<std::uint8_t> data;
};
inline constexpr std::size_t kMaxChunkBytes = 1000;  ///< of data
std::vector<std::uint8_t> encode_chunk(const Chunk& chunk);
Result<Chunk> decode_chunk(std::span<const std::uint8_t> bytes);

/// A `Result` message: the JSON document of `imprint.result/1` with its session and whether it is the last.
struct ResultMessage {
  std::string session;
  bool complete = false;  ///< all expected observations are in, or the session was closed
  std::string error;      ///< why there is no measurement; empty when there is
  std::string json;
};
std::vector<std::uint8_t> encode_result(const ResultMessage& result);
Result<ResultMessage> decode_result(std::span<const std::uint8_t> bytes);

}  // namespace imprint
