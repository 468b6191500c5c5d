// The file of the console's users: a line each, with a role and a password's hash, then a line for each of its tokens.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "console/server/roles.hpp"

namespace tankrig {

/// What scrypt (RFC 7914) made of a password, in 32 MiB.
struct PasswordHash {
  unsigned log2_n = 15, r = 8, p = 3;
  std::string salt, hash;  ///< bytes
};

inline constexpr std::size_t kFewestPasswordBytes = 10, kMostPasswordBytes = 200;

/// With a salt of its own.
/// Errors: InputError if the system has no random numbers, or the password is too short or long.
PasswordHash hash_password(std::string_view password);
bool matches(const PasswordHash& hash, std::string_view password);
/// As costly as any other, and of no password.
const PasswordHash& nobodys_hash();

/// For a program of a user. It is random, so a fast hash hides it as well as a slow one, and each request asks for it.
struct ApiToken {
  std::string label;  ///< its user's word for where it is used
  Role role = Role::kWatch;
  std::string sha256;  ///< of the token, bytes
};

inline constexpr std::size_t kMostTokens = 16;  ///< of one user

/// 160 random bits: "tankrig-" and 40 hexadecimal digits.
/// Errors: InputError if the system has no random numbers.
std::string new_token();
std::string token_hash(std::string_view token);

struct User {
  std::string name;
  Role role = Role::kWatch;
  PasswordHash password;
  std::vector<ApiToken> tokens = {};
};

/// Errors: InputError if it is no name: a lower-case letter, then at most 31 of a-z, 0-9, '.', '_' and '-'.
void check_user_name(const std::string& name);

/// Lines of NAME ROLE scrypt LOG2_N R P SALT HASH, salt and hash in hexadecimal digits; below a user's, lines of NAME
/// token LABEL ROLE sha256 HASH; # begins a comment.
/// Errors: InputError naming the line; if others may read the file; if there is none.
std::vector<User> read_users(const std::filesystem::path& file);
/// Readable by its owner alone.
/// Errors: CannotWrite.
void write_users(const std::filesystem::path& file, const std::vector<User>& users);

}  // namespace tankrig
