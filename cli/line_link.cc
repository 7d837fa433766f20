#include "cli/line_link.h"

#include <algorithm>
#include <thread>

namespace imprint {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr auto kOneTry = milliseconds(1000);
constexpr auto kBetweenTries = milliseconds(30);

}  // namespace

void add_line_options(CLI::App& command, LineOptions& options) {
  command.add_option("--connect", options.connect, "where fusion's router listens")->capture_default_str();
  command.add_option("--site", options.site, "as in the configs")->capture_default_str();
  command.add_option("--line", options.line, "as in the configs")->capture_default_str();
  command
      .add_option("--identity", options.identity, "folder with your certificate, for tls/ endpoints (docs/security.md)")
      ->envname("IMPRINT_IDENTITY");
}

Result<LineLink> LineLink::open(const LineOptions& options) {
  auto keys = Keys::of(options.site, options.line);
  if (!keys) return pass_on(keys.error());
  auto transport = open_zenoh({.connect = {options.connect}, .tool = true, .identity = options.identity});
  if (!transport) return pass_on(transport.error());
  return LineLink(options, std::move(*keys), std::move(*transport));
}

Result<nlohmann::json> LineLink::ask(const std::string& name, const std::string& parameters,
                                     milliseconds timeout) const {
  const auto until = steady_clock::now() + timeout;
  const std::string selector = keys_.fusion_service(name) + (parameters.empty() ? "" : "?" + parameters);
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(until - steady_clock::now());
    if (left <= milliseconds(0)) break;
    const auto replies = transport_->get(selector, {}, std::min(left, kOneTry));
    if (!replies) return pass_on(replies.error());
    if (!replies->empty()) {
      auto document = nlohmann::json::parse(replies->front().payload, nullptr, false);
      if (document.is_discarded()) return job_failed("fusion answered {} with something that is no JSON", selector);
      return document;
    }
    std::this_thread::sleep_for(std::min(left, kBetweenTries));
  }
  return job_failed("no fusion of site {}, line {} answered at {} within {:.1f} s; is imprint-fusion running?",
                    options_.site, options_.line, options_.connect, static_cast<double>(timeout.count()) / 1000.0);
}

}  // namespace imprint
