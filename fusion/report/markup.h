#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace imprint {

/// `text` as content or quoted attribute value of HTML and XML: markup is spelled out, and characters that XML cannot
/// carry at all become U+FFFD. `text` is UTF-8.
std::string markup_text(std::string_view text);

/// `document` for a <script type="application/json">: reads as the same JSON, but holds no '<', '>' or '&', so that no
/// text inside can end the script.
std::string script_json(const nlohmann::json& document);

}  // namespace imprint
