#include "lib/service/document_desk.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <random>

#include "lib/log/log.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

constexpr std::size_t kMaxWaiting = 16;
constexpr std::size_t kKept = 4;
constexpr std::size_t kMaxDocumentBytes = std::size_t{1} << 20U;  // two minutes at 64 kbit/s
constexpr std::size_t kMaxQueryBytes = 16 * 1024;

std::optional<std::uint64_t> number(const Parameters& parameters, const std::string& name) {
  const auto found = parameters.find(name);
  if (found == parameters.end()) return std::nullopt;
  std::uint64_t value = 0;
  const char* end = found->second.data() + found->second.size();
  const auto read = std::from_chars(found->second.data(), end, value);
  return read.ec == std::errc() && read.ptr == end ? std::optional(value) : std::nullopt;
}

}  // namespace

Parameters parameters_of(std::string_view text) {
  Parameters parameters;
  while (!text.empty()) {
    const std::string_view pair = text.substr(0, text.find(';'));
    const auto equals = pair.find('=');
    if (equals != std::string_view::npos && equals > 0)
      parameters[std::string(pair.substr(0, equals))] = std::string(pair.substr(equals + 1));
    text.remove_prefix(std::min(pair.size() + 1, text.size()));
  }
  return parameters;
}

DocumentDesk::DocumentDesk(std::map<std::string, MakeDocument> by_key)
    : by_key_(std::move(by_key)),
      queries_(std::make_shared<BoundedQueue<std::shared_ptr<Query>>>(kMaxWaiting)),
      next_ticket_(std::random_device{}()) {}  // tickets of another start mean other documents

Result<std::unique_ptr<DocumentDesk>> DocumentDesk::open(Transport& transport,
                                                         std::map<std::string, MakeDocument> by_key) {
  std::unique_ptr<DocumentDesk> desk(new DocumentDesk(std::move(by_key)));
  for (const auto& [key, make] : desk->by_key_) {
    auto declared = transport.answer(key, [queries = desk->queries_](std::shared_ptr<Query> query) {
      if (!queries->push(query)) (void)query->reply_error("busy; ask again");
    });
    if (!declared) return pass_on(declared.error());
    desk->declarations_.push_back(std::move(*declared));
  }
  desk->worker_ = std::thread([self = desk.get()] { self->work(); });
  return desk;
}

DocumentDesk::~DocumentDesk() {
  declarations_.clear();
  queries_->drop();
  if (worker_.joinable()) worker_.join();
}

void DocumentDesk::work() {
  while (const auto query = queries_->pop()) answer(**query);
}

void DocumentDesk::answer(Query& query) {
  const Parameters parameters = parameters_of(query.parameters());
  const auto document = document_for(query, parameters);
  if (!document) {
    (void)query.reply_error(document.error().message);
    return;
  }
  const Bytes& bytes = (*document)->bytes;
  const std::size_t offset = std::min<std::size_t>(number(parameters, "offset").value_or(0), bytes.size());
  const std::size_t length = std::min(kMaxChunkBytes, bytes.size() - offset);
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(offset);
  const Chunk chunk{.ticket = (*document)->ticket,
                    .total_bytes = static_cast<std::uint32_t>(bytes.size()),
                    .offset = static_cast<std::uint32_t>(offset),
                    .data = {begin, begin + static_cast<std::ptrdiff_t>(length)}};
  if (const auto replied = query.reply(encode_chunk(chunk)); !replied) spdlog::debug("{}", replied.error().message);
}

Result<const DocumentDesk::Document*> DocumentDesk::document_for(const Query& query, const Parameters& parameters) {
  if (const auto ticket = number(parameters, "ticket")) {
    const auto found = std::ranges::find(kept_, *ticket, &Document::ticket);
    if (found != kept_.end()) return &*found;
    return job_failed("the document is no longer kept; ask for it anew");
  }
  const auto make = by_key_.find(query.key());
  if (make == by_key_.end()) return job_failed("no such service: {}", query.key());
  const Bytes payload = query.payload();
  if (payload.size() > kMaxQueryBytes) return job_failed("expected at most {} bytes with the query", kMaxQueryBytes);
  try {
    auto made = make->second(parameters, payload);
    if (!made) return pass_on(made.error());
    if (made->size() > kMaxDocumentBytes)
      return job_failed("the answer has {} bytes, more than the link is for", made->size());
    if (kept_.size() >= kKept) kept_.pop_front();
    return &kept_.emplace_back(Document{++next_ticket_, std::move(*made)});
  } catch (const std::exception& error) {  // a fault of ours or of a library: this query fails, the desk goes on
    return job_failed("unexpected: {}", error.what());
  }
}

}  // namespace imprint
