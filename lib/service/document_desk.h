#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "lib/daemon/bounded_queue.h"
#include "lib/transport/transport.h"

namespace imprint {

/// What was asked: "lines=50;since=3" as names and values.
using Parameters = std::map<std::string, std::string>;
Parameters parameters_of(std::string_view text);

/// Makes the document a query asks for; its payload is what came with the query.
using MakeDocument = std::function<Result<Bytes>(const Parameters& parameters, const Bytes& payload)>;

/// Answers queries with documents of any length in pieces of at most kMaxChunkBytes, one a query: the asking side asks
/// for the next when it has one, so that a thin link carries one piece at a time, below everything else. A document is
/// kept until four newer ones were asked for; a side that lost its link goes on where it was. One thread makes and
/// answers.
class DocumentDesk {
 public:
  static Result<std::unique_ptr<DocumentDesk>> open(Transport& transport, std::map<std::string, MakeDocument> by_key);
  ~DocumentDesk();
  DocumentDesk(const DocumentDesk&) = delete;
  DocumentDesk& operator=(const DocumentDesk&) = delete;

 private:
  struct Document {
    std::uint64_t ticket = 0;
    Bytes bytes;
  };

  explicit DocumentDesk(std::map<std::string, MakeDocument> by_key);
  void work();
  void answer(Query& query);
  Result<const Document*> document_for(const Query& query, const Parameters& parameters);

  std::map<std::string, MakeDocument> by_key_;
  std::shared_ptr<BoundedQueue<std::shared_ptr<Query>>> queries_;
  std::deque<Document> kept_;
  std::uint64_t next_ticket_;
  std::vector<std::unique_ptr<Declaration>> declarations_;
  std::thread worker_;
};

}  // namespace imprint
