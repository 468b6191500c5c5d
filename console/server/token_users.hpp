// Whose a program's token is: the users' file, read anew whenever it has changed.
#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "console/server/users.hpp"

namespace tankrig {

class TokenUsers {
 public:
  struct Owner {
    std::string name;
    Role role = Role::kWatch;
  };

  explicit TokenUsers(std::filesystem::path file) : file_(std::move(file)) {}

  /// Nothing if nobody has it: a token that was revoked is unknown at once. A file that cannot be read knows none, which
  /// is told on the terminal.
  std::optional<Owner> owner(std::string_view token);

 private:
  void read_if_changed();

  const std::filesystem::path file_;
  struct stat read_ {};  // of the file, as it was read
  std::vector<User> users_;
};

}  // namespace tankrig
