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
  std::string name, role, file, label;
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

Role role_named(const std::string& name) {
  return static_cast<Role>(std::ranges::find(kNames<Role>, name) - kNames<Role>.begin());
}

int add(const UserOptions& options) {
  check_user_name(options.name);
  std::vector<User> users = known_users(options.file);
  if (std::ranges::find(users, options.name, &User::name) != users.end())
    throw InputError(options.file,
                     "found " + options.name + ", expected a new name: tankrig serve user remove it first");
  users.push_back({options.name, role_named(options.role), hash_password(asked_password(options.name))});
  write_users(options.file, users);
  fmt::print("{}: {} may {}\n", options.file, options.name, options.role);
  return kOk;
}

/// Errors: InputError if there is none.
User& user_named(std::vector<User>& users, const UserOptions& options) {
  const auto user = std::ranges::find(users, options.name, &User::name);
  if (user == users.end()) throw InputError(options.file, "found no " + options.name + ", expected one of its users");
  return *user;
}

int add_token(const UserOptions& options) {
  check_user_name(options.label);
  std::vector<User> users = read_users(options.file);
  User& user = user_named(users, options);
  const Role role = options.role.empty() ? user.role : role_named(options.role);
  if (role > user.role)
    throw InputError(options.file, fmt::format("{} may {}, expected a token for no more than that, found {}", user.name,
                                               name_of(user.role), options.role));
  if (std::ranges::count(user.tokens, options.label, &ApiToken::label) > 0)
    throw InputError(options.file, fmt::format("found {}'s token {}, expected a new label: tankrig serve user revoke "
                                               "it first",
                                               user.name, options.label));
  if (user.tokens.size() >= kMostTokens)
    throw InputError(options.file,
                     fmt::format("{} has {} tokens, expected at most that", user.name, user.tokens.size()));
  const std::string token = new_token();
  user.tokens.push_back({options.label, role, token_hash(token)});
  write_users(options.file, users);
  fmt::print(stderr, "{}: programs with this token may {} for {}. It is shown only now:\n", options.file, name_of(role),
             user.name);
  fmt::print("{}\n", token);
  return kOk;
}

int revoke(const UserOptions& options) {
  std::vector<User> users = read_users(options.file);
  User& user = user_named(users, options);
  if (std::erase_if(user.tokens, [&](const ApiToken& token) { return token.label == options.label; }) == 0)
    throw InputError(options.file,
                     "found no token " + options.label + " of " + user.name + ", expected one that was given");
  write_users(options.file, users);
  fmt::print("{}: {}'s token {} is revoked\n", options.file, user.name, options.label);
  return kOk;
}

int list(const UserOptions& options) {
  for (const User& user : read_users(options.file)) {
    fmt::print("{:32} may {}\n", user.name, name_of(user.role));
    for (const ApiToken& token : user.tokens)
      fmt::print("  token {:24} may {}\n", token.label, name_of(std::min(token.role, user.role)));
  }
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
  if (run != &list) c->add_option("name", o.name, "The user's name")->required();
  if (run == &add_token || run == &revoke)
    c->add_option("label", o.label, "Where the token is used: a name for it")->required();
  c->add_option("--users", o.file, "File of users")->required();
  return o;
}

CLI::Option* add_role_option(CLI::App* c, std::string& role, const std::string& what) {
  return c->add_option("--role", role, what)
      ->check(CLI::IsMember(std::vector<std::string>(kNames<Role>.begin(), kNames<Role>.end())));
}

}  // namespace

void add_user(CLI::App& serve, ChosenCommand& chosen) {
  CLI::App* user = serve.add_subcommand("user", "Who may log in at the console, and may do what");
  user->require_subcommand(1);
  CLI::App* c = user->add_subcommand("add", "Add a user; the password is asked for, or is a line on standard input");
  UserOptions& o = user_command(c, chosen, &add);
  add_role_option(c, o.role, "watch: look, and STOP; operate: also runs; administer: also calibrations and repairs")
      ->required();
  c->footer("Example: tankrig serve user add anna --role operate --users console.users");
  c = user->add_subcommand("token", "Give a user a token for a program, and print it");
  add_role_option(c, user_command(c, chosen, &add_token).role, "What it may do; without, what its user may");
  c->footer("Example: tankrig serve user token anna laptop --users console.users");
  c = user->add_subcommand("revoke", "Take a token back: from now on it is unknown");
  user_command(c, chosen, &revoke);
  c->footer("Example: tankrig serve user revoke anna laptop --users console.users");
  c = user->add_subcommand("list", "Users, their tokens, and what each may do");
  user_command(c, chosen, &list);
  c->footer("Example: tankrig serve user list --users console.users");
  c = user->add_subcommand("remove", "Remove a user and its tokens; it may stay logged in for up to twelve hours");
  user_command(c, chosen, &remove);
  c->footer("Example: tankrig serve user remove anna --users console.users");
}

}  // namespace tankrig::app
