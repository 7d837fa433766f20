#include "lib/wire/message_bytes.h"
#include "lib/wire/wire.h"
#include "service.pb.h"

namespace imprint {
namespace {

constexpr std::uint32_t kSchemaVersion = 1;
constexpr std::size_t kMaxBytes = kMaxChunkBytes + 64;

}  // namespace

std::vector<std::uint8_t> encode_chunk(const Chunk& chunk) {
  v1::Chunk message;
  message.set_schema_version(kSchemaVersion);
  message.set_ticket(chunk.ticket);
  message.set_total_bytes(chunk.total_bytes);
  message.set_offset(chunk.offset);
  message.set_data(chunk.data.data(), std::min(chunk.data.size(), kMaxChunkBytes));
  return bytes_of(message);
}

Result<Chunk> decode_chunk(std::span<const std::uint8_t> bytes) {
  const auto message = parse_message<v1::Chunk>(bytes, kMaxBytes);
  if (!message) return invalid_input("chunk: {}", message.error().message);
  const std::string& data = message->data();
  if (data.size() > kMaxChunkBytes || std::uint64_t{message->offset()} + data.size() > message->total_bytes())
    return invalid_input("chunk: expected a piece of a document of {} bytes, found {} bytes at {}",
                         message->total_bytes(), data.size(), message->offset());
  return Chunk{message->ticket(), message->total_bytes(), message->offset(), {data.begin(), data.end()}};
}

}  // namespace imprint
