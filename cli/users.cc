#include <termios.h>
#include <unistd.h>

#include "cli/command.h"
#include "lib/access/user_list.h"
#include "lib/config/file_lock.h"
#include "lib/wire/keys.h"

namespace imprint {
namespace {

struct UsersOptions {
  std::string file = "users.json";
  std::string name;
  std::string role = "viewer";
};

// From the terminal without showing it, or the first line of a pipe.
std::string ask_password() {
  termios shown{};
  const bool terminal = ::tcgetattr(STDIN_FILENO, &shown) == 0;
  if (terminal) {
    termios hidden = shown;
    hidden.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    std::cerr << "Password: ";
    ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &hidden);
  }
  std::string password;
  std::getline(std::cin, password);
  if (terminal) {
    ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &shown);
    std::cerr << '\n';
  }
  return password;
}

// Reads the list, changes it, writes it; two commands at once do not lose each other's change.
Result<void> change(const std::string& file, const std::function<Result<void>(UserList&)>& alter) {
  const auto lock = FileLock::take(file + ".lock", "another `imprint users` is changing it");
  if (!lock) return pass_on(lock.error());
  UserList list;
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    auto read = read_user_list(file);
    if (!read) return pass_on(read.error());
    list = std::move(*read);
  }
  if (auto altered = alter(list); !altered) return altered;
  return write_user_list(file, list);
}

int run_set(const UsersOptions& options, bool as_json) {
  const auto role = role_from_name(options.role);
  if (!role) return fail(role.error());
  if (auto valid = check_id("user", options.name); !valid) return fail(valid.error());
  const auto hash = hash_password(ask_password());
  if (!hash) return fail(hash.error());
  const auto changed = change(options.file, [&](UserList& list) -> Result<void> {
    std::erase_if(list.users, [&](const User& user) { return user.name == options.name; });
    list.users.push_back({options.name, *role, *hash});
    return {};
  });
  if (!changed) return fail(changed.error());
  if (as_json) return print_json({{"name", options.name}, {"role", options.role}});
  std::cout << fmt::format("{}: {} {}\n", options.file, options.role, options.name);
  return 0;
}

int run_remove(const UsersOptions& options, bool as_json) {
  const auto changed = change(options.file, [&](UserList& list) -> Result<void> {
    if (std::erase_if(list.users, [&](const User& user) { return user.name == options.name; }) == 0)
      return invalid_input("{}: has no user {}", options.file, options.name);
    return {};
  });
  if (!changed) return fail(changed.error());
  return as_json ? print_json({{"removed", options.name}}) : 0;
}

int run_list(const UsersOptions& options, bool as_json) {
  const auto list = read_user_list(options.file);
  if (!list) return fail(list.error());
  nlohmann::json users = nlohmann::json::array();
  for (const User& user : list->users) {
    users.push_back({{"name", user.name}, {"role", role_name(user.role)}});
    if (!as_json) std::cout << fmt::format("{:<20} {}\n", user.name, role_name(user.role));
  }
  return as_json ? print_json({{"users", users}}) : 0;
}

}  // namespace

void add_users_command(Cli& cli) {
  auto options = std::make_shared<UsersOptions>();
  CLI::App* users = cli.app.add_subcommand("users", "who may sign in at fusion's page (docs/security.md)");
  users->require_subcommand(1);
  const auto add = [&](const char* name, const char* help, int (*run)(const UsersOptions&, bool)) {
    CLI::App* sub = cli.command(*users, name, help, [&cli, options, run] { return run(*options, cli.json); });
    sub->add_option("--file", options->file, "as page.users of fusion.toml")->capture_default_str();
    return sub;
  };
  CLI::App* set = add("set", "a user's role and password, which is read from the terminal or a pipe", run_set);
  set->add_option("name", options->name, "who")->required();
  set->add_option("--role", options->role, "viewer, operator or engineer")
      ->check(CLI::IsMember({"viewer", "operator", "engineer"}))
      ->capture_default_str();
  add("remove", "takes a user out", run_remove)->add_option("name", options->name, "who")->required();
  add("list", "all users", run_list);
}

}  // namespace imprint
