#pragma once

#include "fusion/serve/line_board.h"
#include "fusion/store/session_store.h"
#include "lib/result/result.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"

namespace imprint {

/// Answers a query on `fusion/service/status` or `fusion/service/result` (parameter `session`; without it the latest).
Result<void> answer_query(Query& query, const Keys& keys, const LineBoard& board, SessionStore& store);

}  // namespace imprint
