#include "lib/service/document_reader.h"

#include <algorithm>
#include <thread>

#include "lib/wire/wire.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto kOnePiece = milliseconds(3000);  // at 64 kbit/s, behind the imprints of three cameras
constexpr auto kBetweenTries = milliseconds(30);
constexpr std::size_t kMaxDocumentBytes = std::size_t{4} << 20U;

}  // namespace

Result<Bytes> read_document(Transport& transport, const std::string& key, const std::string& parameters,
                            std::span<const std::uint8_t> payload, milliseconds timeout) {
  const auto until = steady_clock::now() + timeout;
  Bytes document;
  std::string selector = parameters.empty() ? key : key + '?' + parameters;
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(until - steady_clock::now());
    if (left <= milliseconds(0)) break;
    const auto replies = transport.get(selector, document.empty() ? payload : std::span<const std::uint8_t>{},
                                       std::min(left, kOnePiece), Traffic::bulk);
    if (!replies) return pass_on(replies.error());
    if (replies->empty()) {  // not connected yet, or lost
      std::this_thread::sleep_for(std::min(left, kBetweenTries));
      continue;
    }
    const auto chunk = decode_chunk(replies->front().payload);
    if (!chunk) return pass_on(chunk.error());
    if (chunk->total_bytes > kMaxDocumentBytes || chunk->offset != document.size())
      return job_failed("{}: expected the piece at byte {}, found that at {} of {}", key, document.size(),
                        chunk->offset, chunk->total_bytes);
    document.insert(document.end(), chunk->data.begin(), chunk->data.end());
    if (document.size() >= chunk->total_bytes) return document;
    if (chunk->data.empty())
      return job_failed("{}: an empty piece at byte {} of {}", key, document.size(), chunk->total_bytes);
    selector = fmt::format("{}?ticket={};offset={}", key, chunk->ticket, document.size());
  }
  return job_failed("{}: {} within {:.1f} s", key, document.empty() ? "nobody answered" : "only a part came",
                    static_cast<double>(timeout.count()) / 1000.0);
}

}  // namespace imprint
