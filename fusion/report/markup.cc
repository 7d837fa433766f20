#include "fusion/report/markup.h"

namespace imprint {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

bool carried_by_xml(unsigned char c) { return c >= 0x20 || c == '\t' || c == '\n' || c == '\r'; }

// U+FFFE and U+FFFF, the only other characters that XML excludes and UTF-8 can hold.
bool is_noncharacter(std::string_view rest) {
  return rest.starts_with("\xEF\xBF\xBE") || rest.starts_with("\xEF\xBF\xBF");
}

}  // namespace

std::string markup_text(std::string_view text) {
  std::string markup;
  markup.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_noncharacter(text.substr(i))) {
      markup += kReplacement;
      i += 2;
    } else if (c == '<') {
      markup += "&lt;";
    } else if (c == '>') {
      markup += "&gt;";
    } else if (c == '&') {
      markup += "&amp;";
    } else if (c == '"') {
      markup += "&quot;";
    } else if (c == '\'') {
      markup += "&#39;";
    } else if (!carried_by_xml(static_cast<unsigned char>(c))) {
      markup += kReplacement;
    } else {
      markup += c;
    }
  }
  return markup;
}

std::string script_json(const nlohmann::json& document) {
  // Outside of its texts JSON has none of these characters. All that is not ASCII is spelled out by the writer.
  std::string script;
  for (const char c : document.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace)) {
    if (c == '<') {
      script += "\\u003c";
    } else if (c == '>') {
      script += "\\u003e";
    } else if (c == '&') {
      script += "\\u0026";
    } else {
      script += c;
    }
  }
  return script;
}

}  // namespace imprint
