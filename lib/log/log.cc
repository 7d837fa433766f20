#include "lib/log/log.h"

#include <spdlog/sinks/ringbuffer_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

namespace imprint {
namespace {

constexpr std::size_t kRemembered = 500;

std::shared_ptr<spdlog::sinks::ringbuffer_sink_mt> recent() {
  static const auto sink = std::make_shared<spdlog::sinks::ringbuffer_sink_mt>(kRemembered);
  return sink;
}

}  // namespace

Result<void> open_log(std::string_view name, std::string_view level) {
  const auto parsed = spdlog::level::from_str(std::string(level));
  if (parsed == spdlog::level::off && level != "off") {
    return invalid_input("log level \"{}\": expected trace, debug, info, warning, error or off", level);
  }
  auto logger = spdlog::stderr_logger_mt(std::string(name));
  logger->sinks().push_back(recent());
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %n: %v");
  logger->set_level(parsed);
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(logger);
  return {};
}

std::string recent_log(std::size_t lines) {
  std::string text;
  for (const std::string& line : recent()->last_formatted(lines)) text += line;
  return text;
}

}  // namespace imprint
