#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace imprint {

/// `text` without blanks and carriage returns at its ends.
std::string trimmed(std::string_view text);

/// The cells of one line of a CSV file, each trimmed. No quoting: our files hold numbers and plain names.
std::vector<std::string> csv_cells(const std::string& line);

/// Reads all of `text` as a finite number; false, `value` undefined, when it is none.
template <class Number>
bool parse_number(const std::string& text, Number& value) {
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if constexpr (std::is_floating_point_v<Number>) {
    if (fault == std::errc{} && !std::isfinite(value)) return false;
  }
  return fault == std::errc{} && end == text.data() + text.size();
}

}  // namespace imprint
