#include <atomic>
#include <numeric>

#include <catch2/catch.hpp>

#include "lib/service/document_desk.h"
#include "lib/service/document_reader.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

using std::chrono::milliseconds;

Bytes numbered(std::size_t size) {
  Bytes bytes(size);
  std::iota(bytes.begin(), bytes.end(), 0);
  return bytes;
}

struct Link {
  std::shared_ptr<MemoryBus> bus = make_memory_bus();
  std::unique_ptr<Transport> here = open_memory(bus);
  std::unique_ptr<Transport> there = open_memory(bus);

  std::unique_ptr<DocumentDesk> desk(MakeDocument make) const {
    auto opened = DocumentDesk::open(*there, {{"line/log", std::move(make)}});
    REQUIRE(opened);
    return std::move(*opened);
  }
  Result<Bytes> read(const std::string& parameters = "", const Bytes& payload = {}) const {
    return read_document(*here, "line/log", parameters, payload, milliseconds(3000));
  }
};

}  // namespace

TEST_CASE("documents: any length comes whole, in pieces of at most 1,000 bytes, made once") {
  const Link link;
  for (const std::size_t size : {0U, 1U, 999U, 1000U, 1001U, 54'321U}) {
    std::atomic<int> made = 0;
    std::atomic<std::size_t> pieces = 0;
    const auto desk = link.desk([&](const Parameters&, const Bytes&) -> Result<Bytes> {
      ++made;
      return numbered(size);
    });
    const auto read = link.read();
    REQUIRE(read);
    REQUIRE(*read == numbered(size));
    REQUIRE(made == 1);
    const auto first = link.here->get("line/log", {}, milliseconds(1000));
    REQUIRE(first);
    REQUIRE(first->front().payload.size() <= 1024);
    REQUIRE(decode_chunk(first->front().payload)->data.size() == std::min<std::size_t>(size, kMaxChunkBytes));
  }
}

TEST_CASE("documents: parameters and what comes with the query reach the maker, its refusal the asking side") {
  const Link link;
  const auto desk = link.desk([](const Parameters& parameters, const Bytes& payload) -> Result<Bytes> {
    if (payload.empty()) return job_failed("nothing to set");
    REQUIRE(parameters.at("check") == "1");
    REQUIRE(parameters.at("empty").empty());
    return payload;
  });
  REQUIRE(*link.read("check=1;empty=;odd", {1, 2, 3}) == Bytes{1, 2, 3});
  const auto refused = link.read("check=1;empty=");
  REQUIRE_FALSE(refused);
  REQUIRE(refused.error().message.find("nothing to set") != std::string::npos);
}

TEST_CASE("documents: a piece asked for again is the same, one of a document no longer kept is said so") {
  const Link link;
  std::size_t size = 3000;
  const auto desk = link.desk([&](const Parameters&, const Bytes&) -> Result<Bytes> { return numbered(size++); });
  const auto first = decode_chunk(link.here->get("line/log", {}, milliseconds(1000))->front().payload);
  REQUIRE(first);
  const std::string again = fmt::format("line/log?ticket={};offset=2000", first->ticket);
  REQUIRE(decode_chunk(link.here->get(again, {}, milliseconds(1000))->front().payload)->data.size() == 1000);
  REQUIRE(decode_chunk(link.here->get(again, {}, milliseconds(1000))->front().payload)->data.size() == 1000);
  for (int i = 0; i < 4; ++i) REQUIRE(link.read());
  const auto gone = link.here->get(again, {}, milliseconds(1000));
  REQUIRE_FALSE(gone);
  REQUIRE(gone.error().message.find("no longer kept") != std::string::npos);
}

TEST_CASE("documents: nobody there, and a maker that throws, are errors and not the end") {
  const Link link;
  REQUIRE_FALSE(read_document(*link.here, "line/none", "", {}, milliseconds(200)));
  bool throwing = true;
  const auto desk = link.desk([&](const Parameters&, const Bytes&) -> Result<Bytes> {
    if (throwing) throw std::runtime_error("broken");
    return Bytes{7};
  });
  REQUIRE_FALSE(link.read());
  throwing = false;
  REQUIRE(*link.read() == Bytes{7});
}

TEST_CASE("chunks: what is none, and what lies outside its document, is refused") {
  const Chunk chunk{.ticket = 5, .total_bytes = 10, .offset = 4, .data = {1, 2, 3}};
  const auto bytes = encode_chunk(chunk);
  REQUIRE(decode_chunk(bytes)->data == chunk.data);
  for (std::size_t length = 0; length < bytes.size(); ++length) (void)decode_chunk({bytes.data(), length});
  REQUIRE_FALSE(decode_chunk({}));
  REQUIRE_FALSE(decode_chunk(encode_chunk({.ticket = 5, .total_bytes = 6, .offset = 4, .data = {1, 2, 3}})));
  REQUIRE_FALSE(decode_chunk(Bytes(5000, 1)));
}

}  // namespace imprint
