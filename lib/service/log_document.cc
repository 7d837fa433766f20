#include "lib/service/log_document.h"

#include <charconv>

#include "lib/log/log.h"

namespace imprint {
namespace {

constexpr std::size_t kDefaultLines = 40;

}  // namespace

Result<Bytes> log_document(const Parameters& parameters, const Bytes&) {
  std::size_t lines = kDefaultLines;
  if (const auto asked = parameters.find("lines"); asked != parameters.end()) {
    const char* end = asked->second.data() + asked->second.size();
    if (const auto read = std::from_chars(asked->second.data(), end, lines); read.ec != std::errc() || read.ptr != end)
      return invalid_input("lines: expected a number, found \"{}\"", asked->second);
  }
  const std::string text = recent_log(lines);
  return Bytes(text.begin(), text.end());
}

}  // namespace imprint
