#include "cli/command_line.h"

#include <catch2/catch.hpp>

using namespace imprint;
using Catch::Matchers::Contains;

namespace {

// A program with a group of commands and one that stands alone.
struct Program {
  CLI::App app{"for tests", "prog"};
  double share = 0.0;
  std::string file;

  Program() {
    app.require_subcommand(1);
    auto* group = app.add_subcommand("group", "a group");
    group->require_subcommand(1);
    group->add_subcommand("inner", "one of the group");
    auto* alone = app.add_subcommand("alone", "stands alone");
    alone->add_option("--share", share, "a share")->check(between(0.5, 2));
    alone->add_option("file", file, "a file");
  }

  std::optional<int> parse(std::vector<std::string> words) {
    words.insert(words.begin(), "prog");
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    return parse_command_line(app, static_cast<int>(argv.size()), argv.data());
  }
};

}  // namespace

TEST_CASE("command line: a word that is no command is named, with those there are") {
  const Program program;
  const std::vector<std::string> nonsense = {"nonsense"}, inner_nonsense = {"group", "nonsense"}, none;
  REQUIRE_THAT(command_fault(program.app, nonsense).value_or(""),
               Contains("group, alone") && Contains("found \"nonsense\""));
  REQUIRE_THAT(command_fault(program.app, inner_nonsense).value_or(""),
               Contains("group: ") && Contains("inner") && Contains("found \"nonsense\""));
  REQUIRE_THAT(command_fault(program.app, none).value_or(""), Contains("found none"));
}

TEST_CASE("command line: a command, and an option in its place, are left to the parser") {
  const Program program;
  const std::vector<std::string> alone = {"alone", "file"}, inner = {"group", "inner"}, help = {"--help"};
  REQUIRE_FALSE(command_fault(program.app, alone));
  REQUIRE_FALSE(command_fault(program.app, inner));
  REQUIRE_FALSE(command_fault(program.app, help));
}

TEST_CASE("command line: wrong use ends with status 2, a number outside its range or no number at all included") {
  for (const char* share : {"0.4", "2.1", "nan", "much", ""}) {
    Program program;
    REQUIRE(program.parse({"alone", "--share", share}) == 2);
  }
  Program program;
  REQUIRE(program.parse({"alone", "--share", "2"}) == std::nullopt);
  REQUIRE(program.share == 2.0);
  REQUIRE(Program().parse({"alone", "--nonsense"}) == 2);
  REQUIRE(Program().parse({"nonsense"}) == 2);
}
