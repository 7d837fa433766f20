#pragma once

#include <string_view>

namespace imprint {

/// report.css with look.css, as they were at build time.
extern const std::string_view kReportLook;

}  // namespace imprint
