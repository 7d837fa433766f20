#include "fusion/serve/query_answer.h"

#include <algorithm>
#include <span>
#include <string>
#include <string_view>

namespace imprint {
namespace {

std::string parameter(std::string_view parameters, std::string_view name) {
  while (!parameters.empty()) {
    const auto end = std::min(parameters.find(';'), parameters.size());
    const std::string_view pair = parameters.substr(0, end);
    if (pair.starts_with(name) && pair.size() > name.size() && pair[name.size()] == '=') {
      return std::string(pair.substr(name.size() + 1));
    }
    parameters.remove_prefix(std::min(end + 1, parameters.size()));
  }
  return {};
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

Result<void> answer_query(Query& query, const Keys& keys, const LineBoard& board, SessionStore& store) {
  if (query.key() == keys.fusion_service("status")) {
    return query.reply(bytes_of(board.status(std::chrono::steady_clock::now()).dump()));
  }
  const std::string session = parameter(query.parameters(), "session");
  const auto result = session.empty() ? store.latest_result() : store.result(session);
  if (!result) return query.reply_error(result.error().message);
  if (!result->has_value()) {
    return query.reply_error(session.empty() ? "no result yet" : "no result of session " + session);
  }
  return query.reply(bytes_of(to_json(**result).dump()));
}

}  // namespace imprint
