#pragma once

#include "lib/service/document_desk.h"

namespace imprint {

/// The last `lines` (default 40) of this process' log, for a DocumentDesk.
Result<Bytes> log_document(const Parameters& parameters, const Bytes& payload);

}  // namespace imprint
