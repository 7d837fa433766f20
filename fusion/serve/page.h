#pragma once

#include <string_view>

namespace imprint {

/// page.html as it was at build time.
extern const std::string_view kPage;

}  // namespace imprint
