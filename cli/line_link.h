#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "lib/result/result.h"
#include "lib/transport/transport.h"
#include "lib/wire/keys.h"

namespace imprint {

/// Which line of which plant a command speaks to, and how it is reached.
struct LineOptions {
  std::string connect = "tcp/127.0.0.1:7447";
  std::string site = "plant";
  std::string line = "L1";
  std::string identity;  // folder of `imprint certs issue`; empty: no TLS
};

void add_line_options(CLI::App& command, LineOptions& options);

/// A command's connection to the running line.
class LineLink {
 public:
  static Result<LineLink> open(const LineOptions& options);

  [[nodiscard]] Transport& transport() const { return *transport_; }
  [[nodiscard]] const Keys& keys() const { return keys_; }

  /// What fusion answers to `fusion/service/<name>`; asked again until `timeout`, for the connection may take a moment.
  /// Fails (job_failed) when fusion says so or nobody answers.
  [[nodiscard]] Result<nlohmann::json> ask(const std::string& name, const std::string& parameters,
                                           std::chrono::milliseconds timeout) const;

 private:
  LineLink(LineOptions options, Keys keys, std::unique_ptr<Transport> transport)
      : options_(std::move(options)), keys_(std::move(keys)), transport_(std::move(transport)) {}

  LineOptions options_;
  Keys keys_;
  std::unique_ptr<Transport> transport_;
};

}  // namespace imprint
