// `tankrig serve user`: who may log in at the console.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/serve/listen_options.hpp"
#include "console/server/users.hpp"
#include "core/input_error.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct UserOptions {
  std::string name, role, file;
};

/// What is typed is not shown while this lives.
class NoEcho {
 public:
  NoEcho() {
    ::tcgetattr(STDIN_FILENO, &before_);
    termios quiet = before_;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &quiet);
  }
  ~NoEcho() { ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_); }
  NoEcho(const NoEcho&) = delete;
  NoEcho& operator=(const NoEcho&) = delete;

 private:
  termios before_{};
};

std::string line() {
  std::string text;
  if (!std::getline(std::cin, text)) throw InputError("password: found no line on standard input, expected one");
  return text;
}

std::string asked_password(const std::string& name) {
  if (::isatty(STDIN_FILENO) == 0) return line();
  const NoEcho quiet;
  const auto ask = [](const std::string& what) {
    fmt::print(stderr, "{}: ", what);
    std::string text = line();
    fmt::print(stderr, "\n");
    return text;
  };
  std::string password = ask("Password of " + name);
  if (ask("The same again") != password) throw InputError("password: found two, expected the same twice");
  return password;
}

std::vector<User> known_users(const fs::path& file) {
  return fs::exists(file) ? read_users(file) : std::vector<User>{};
}

int add(const UserOptions& options) {
  check_user_name(options.name);
  std::vector<User> users = known_users(options.file);
  if (std::ranges::find(users, options.name, &User::name) != users.end())
    throw InputError(options.file,
                     "found " + options.name + ", expected a new name: tankrig serve user remove it first");
  const auto role = static_cast<Role>(std::ranges::find(kNames<Role>, options.role) - kNames<Role>.begin());
  users.push_back({options.name, role, hash_password(asked_password(options.name))});
  write_users(options.file, users);
  fmt::print("{}: {} may {}\n", options.file, options.name, options.role);
  return kOk;
}

int remove(const UserOptions& options) {
  std::vector<User> users = read_users(options.file);
  if (std::erase_if(users, [&](const User& user) { return user.name == options.name; }) == 0)
    throw InputError(options.file, "found no " + options.name + ", expected one of its users");
  write_users(options.file, users);
  fmt::print("{}: {} may no longer log in\n", options.file, options.name);
  return kOk;
}

UserOptions& user_command(CLI::App* c, ChosenCommand& chosen, int (*run)(const UserOptions&)) {
  UserOptions& o = options_of(c, chosen, run);
  c->add_option("name", o.name, "The user's name")->required();
  c->add_option("--users", o.file, "File of users")->required();
  return o;
}

}  // namespace

void add_user(CLI::App& serve, ChosenCommand& chosen) {
  CLI::App* user = serve.add_subcommand("user", "Who may log in at the console, and may do what");
  user->require_subcommand(1);
  CLI::App* c = user->add_subcommand("add", "Add a user; the password is asked for, or is a line on standard input");
  UserOptions& o = user_command(c, chosen, &add);
  c->add_option("--role", o.role,
                "watch: look, and STOP; operate: also runs; administer: also calibrations and repairs")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kNames<Role>.begin(), kNames<Role>.end())));
  c->footer("Example: tankrig serve user add anna --role operate --users console.users");
  c = user->add_subcommand("remove", "Remove a user, who may stay logged in for up to twelve hours");
  user_command(c, chosen, &remove);
  c->footer("Example: tankrig serve user remove anna --users console.users");
}

}  // namespace tankrig::app
