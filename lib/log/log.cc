#include "lib/log/log.h"

#include <spdlog/sinks/stdout_sinks.h>

namespace imprint {

Result<void> open_log(std::string_view name, std::string_view level) {
  const auto parsed = spdlog::level::from_str(std::string(level));
  if (parsed == spdlog::level::off && level != "off") {
    return invalid_input("log level \"{}\": expected trace, debug, info, warning, error or off", level);
  }
  auto logger = spdlog::stderr_logger_mt(std::string(name));
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %n: %v");
  logger->set_level(parsed);
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(logger);
  return {};
}

}  // namespace imprint
