#pragma once

#include <optional>
#include <span>
#include <string>

#include <CLI/CLI.hpp>

namespace imprint {

/// Checks that an option is a number from `low` to `high`; --help shows the range. Not a number (nan) is refused.
CLI::Validator between(double low, double high);

/// What is wrong with the command that `words` begin with ("imprint WORDS..."), seen from `app`: a word that is no
/// command, or no word where one is needed. Nothing when there is a command, or an option in its place.
std::optional<std::string> command_fault(const CLI::App& app, std::span<const std::string> words);

/// Parses the command line. Gives the exit status where that ends the program: 0 after --help and --version, 2 after
/// wrong use, which one line on stderr explains.
std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv);

}  // namespace imprint
