#include "cli/command_line.h"

#include <algorithm>
#include <iostream>
#include <vector>

#include <fmt/core.h>

#include "lib/config/csv_row.h"

namespace imprint {
namespace {

constexpr int kWrongUse = 2;

// "imprint targets detect": the commands that were given, as far as they are known.
std::string spelled_out(const CLI::App& app) {
  std::string names = app.get_name();
  for (const CLI::App* sub : app.get_subcommands()) names += " " + spelled_out(*sub);
  return names;
}

}  // namespace

CLI::Validator between(double low, double high) {
  const std::string range = fmt::format("{} to {}", low, high);
  const auto fault = [=](const std::string& text) -> std::string {
    double value = 0.0;
    if (parse_number(text, value) && value >= low && value <= high) return {};
    return fmt::format("expected {}, found {}", range, text);
  };
  return CLI::Validator(fault, range);
}

std::optional<std::string> command_fault(const CLI::App& app, std::span<const std::string> words) {
  if (app.get_require_subcommand_min() == 0) return std::nullopt;
  if (!words.empty() && words.front().starts_with('-')) return std::nullopt;
  std::string known;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (!words.empty() && sub->check_name(words.front())) return command_fault(*sub, words.subspan(1));
    known.append(known.empty() ? "" : ", ").append(sub->get_name());
  }
  const std::string found = words.empty() ? "none" : fmt::format("\"{}\"", words.front());
  const std::string place = app.get_parent() == nullptr ? "" : app.get_name() + ": ";
  return fmt::format("{}expected one of the commands {}; found {}", place, known, found);
}

std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv) {
  const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (const auto fault = command_fault(app, words)) {
    std::cerr << fmt::format("{}: {}; see {} --help\n", app.get_name(), *fault, app.get_name());
    return kWrongUse;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::cerr << fmt::format("{}: {}; see {} --help\n", app.get_name(), error.what(), spelled_out(app));
    return kWrongUse;
  }
  return std::nullopt;
}

}  // namespace imprint
