// imprint-board: on a board at each start, before its network and its node.
#include <iostream>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "firmware_config/board_files.h"
#include "lib/daemon/program.h"

int main(int argc, char** argv) {
  CLI::App app{"Makes the files that board.toml stands for", "imprint-board"};
  std::string file;
  std::string root;
  std::string part;
  app.add_option("board", file, "board.toml")->required();
  app.add_option("--out", root, "where to write them; without it the file is only checked");
  app.add_option("--part", part, "only those below this folder")->check(CLI::IsMember({"run", "boot"}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return imprint::exit_status_of("imprint-board", [&]() -> imprint::Result<void> {
    const auto config = imprint::read_board_config(file);
    if (!config) return imprint::pass_on(config.error());
    if (root.empty()) {
      std::cout << file << ": OK\n";
      return {};
    }
    return imprint::write_board_files(*config, root, part);
  });
}
