#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toml++/toml.h>

#include "lib/result/result.h"

namespace imprint {

/// Settings that an engineer has made from afar (`imprint config set`): assignments such as `exposure.auto=false`, kept
/// beside the spool and laid over the node's own config. New ones are on trial first: in force for one start of the
/// node, kept only when that start has found fusion, forgotten when it has not or has ended before.
class RemoteSettings {
 public:
  /// Reads what is kept. A trial that an earlier start has begun and not finished is over: it was no good.
  static Result<RemoteSettings> open(std::filesystem::path folder);

  /// Lays them over the config, those on trial last, and begins the trial if there is one.
  Result<void> lay_over(toml::table& table);
  /// The settings that would be in force with these added: later ones replace earlier ones of the same key. Fails
  /// (invalid_input) on what is no assignment, and on keys that would make the node another one.
  [[nodiscard]] Result<std::vector<std::string>> with(const std::vector<std::string>& assignments) const;
  /// Puts them on trial; the next start tries them.
  Result<void> propose(const std::vector<std::string>& settings);

  [[nodiscard]] bool on_trial() const { return on_trial_; }
  Result<void> accept();
  void roll_back(const std::string& why);

  [[nodiscard]] const std::vector<std::string>& kept() const { return kept_; }
  /// Why the last proposal is not in force; empty when it is.
  [[nodiscard]] const std::string& refused() const { return refused_; }

 private:
  explicit RemoteSettings(std::filesystem::path folder) : folder_(std::move(folder)) {}
  [[nodiscard]] std::filesystem::path file(const char* name) const { return folder_ / name; }

  std::filesystem::path folder_;
  std::vector<std::string> kept_;
  std::vector<std::string> proposed_;
  bool on_trial_ = false;
  std::string refused_;
};

}  // namespace imprint
