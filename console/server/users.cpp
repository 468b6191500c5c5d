#include "console/server/users.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <sys/random.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <iterator>
#include <optional>
#include <sstream>

#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "core/shown_text.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

constexpr std::size_t kSaltBytes = 16, kHashBytes = 32, kLongestName = 32, kMostFileBytes = 1 << 20;
constexpr std::uint64_t kMostMemory = 256U << 20;
constexpr std::size_t kTokenBytes = 20;
constexpr char kLine[] = "NAME ROLE scrypt LOG2_N R P SALT HASH", kTokenLine[] = "NAME token LABEL ROLE sha256 HASH";

std::string scrypt(const PasswordHash& of, std::string_view password) {
  std::string key(kHashBytes, '\0');
  const auto* salt = reinterpret_cast<const unsigned char*>(of.salt.data());
  if (EVP_PBE_scrypt(password.data(), password.size(), salt, of.salt.size(), std::uint64_t{1} << of.log2_n, of.r, of.p,
                     kMostMemory, reinterpret_cast<unsigned char*>(key.data()), key.size()) != 1)
    throw InputError("password: scrypt failed, expected memory for it");
  return key;
}

std::string hexadecimal(std::string_view bytes) {
  std::string digits;
  for (const unsigned char byte : bytes) digits += fmt::format("{:02x}", byte);
  return digits;
}

std::optional<std::string> bytes_of(std::string_view digits) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    unsigned char byte = 0;
    const char* end = digits.data() + i + 2;
    if (std::from_chars(end - 2, end, byte, 16).ptr != end) return std::nullopt;
    bytes += static_cast<char>(byte);
  }
  if (digits.size() % 2 != 0) return std::nullopt;
  return bytes;
}

std::optional<unsigned> number_of(std::string_view digits, unsigned least, unsigned most) {
  unsigned number = 0;
  const char* end = digits.data() + digits.size();
  if (std::from_chars(digits.data(), end, number).ptr != end || number < least || number > most) return std::nullopt;
  return number;
}

bool is_name(std::string_view name) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !name.empty() && name.size() <= kLongestName && letter(name[0]) && std::ranges::all_of(name, [&](char c) {
    return letter(c) || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
  });
}

Role role_of(const std::string& word) {
  const auto role = std::ranges::find(kNames<Role>, word);
  if (role == kNames<Role>.end())
    throw InputError(
        fmt::format("found the role '{}', expected one of: {}", shown_text(word), fmt::join(kNames<Role>, ", ")));
  return static_cast<Role>(role - kNames<Role>.begin());
}

bool is_token(const std::vector<std::string>& words) { return words.size() > 1 && words[1] == "token"; }

/// Errors: InputError without the line's number.
void add_token(const std::vector<std::string>& words, std::vector<User>& users) {
  if (words.size() != 6) throw InputError(fmt::format("found {} words, expected {}", words.size(), kTokenLine));
  const auto user = std::ranges::find(users, words[0], &User::name);
  if (user == users.end())
    throw InputError("found a token of " + shown_text(words[0]) + ", expected a line of this user above it");
  ApiToken token;
  check_user_name(token.label = words[2]);
  token.role = role_of(words[3]);
  const auto hash = bytes_of(words[5]);
  if (words[4] != "sha256" || !hash || hash->size() != kHashBytes)
    throw InputError(fmt::format("found '{}' and {} characters, expected sha256 and {} hexadecimal digits",
                                 shown_text(words[4]), words[5].size(), 2 * kHashBytes));
  token.sha256 = *hash;
  if (std::ranges::count(user->tokens, token.label, &ApiToken::label) > 0)
    throw InputError(fmt::format("found {}'s token {} twice, expected each once", user->name, token.label));
  if (user->tokens.size() >= kMostTokens)
    throw InputError(fmt::format("found more tokens of {}, expected at most {}", user->name, kMostTokens));
  user->tokens.push_back(token);
}

/// Errors: InputError without the line's number; a password's hash is not shown.
User user_of(const std::vector<std::string>& words) {
  if (words.size() != 8) throw InputError(fmt::format("found {} words, expected {}", words.size(), kLine));
  User user;
  check_user_name(user.name = words[0]);
  user.role = role_of(words[1]);
  if (words[2] != "scrypt") throw InputError("found '" + shown_text(words[2]) + "', expected scrypt");
  const auto log2_n = number_of(words[3], 10, 17), r = number_of(words[4], 1, 8), p = number_of(words[5], 1, 16);
  if (!log2_n || !r || !p)
    throw InputError(fmt::format("found scrypt {} {} {}, expected LOG2_N of 10 to 17, R of 1 to 8, P of 1 to 16",
                                 shown_text(words[3]), shown_text(words[4]), shown_text(words[5])));
  const auto salt = bytes_of(words[6]), hash = bytes_of(words[7]);
  if (!salt || salt->size() != kSaltBytes || !hash || hash->size() != kHashBytes)
    throw InputError(fmt::format("found salt and hash of {} and {} characters, expected {} and {} hexadecimal digits",
                                 words[6].size(), words[7].size(), 2 * kSaltBytes, 2 * kHashBytes));
  user.password = {*log2_n, *r, *p, *salt, *hash};
  return user;
}

}  // namespace

PasswordHash hash_password(std::string_view password) {
  if (password.size() < kFewestPasswordBytes || password.size() > kMostPasswordBytes)
    throw InputError(fmt::format("password: found {} bytes, expected {} to {}", password.size(), kFewestPasswordBytes,
                                 kMostPasswordBytes));
  PasswordHash made;
  made.salt.resize(kSaltBytes);
  if (::getrandom(made.salt.data(), kSaltBytes, 0) != static_cast<ssize_t>(kSaltBytes))
    throw InputError("password: no random numbers from the system, expected some for its salt");
  made.hash = scrypt(made, password);
  return made;
}

bool matches(const PasswordHash& hash, std::string_view password) {
  const std::string found = scrypt(hash, password);
  return found.size() == hash.hash.size() && CRYPTO_memcmp(found.data(), hash.hash.data(), found.size()) == 0;
}

std::string new_token() {
  std::string bytes(kTokenBytes, '\0');
  if (::getrandom(bytes.data(), kTokenBytes, 0) != static_cast<ssize_t>(kTokenBytes))
    throw InputError("token: no random numbers from the system, expected some for it");
  return "tankrig-" + hexadecimal(bytes);
}

std::string token_hash(std::string_view token) {
  std::string hash(kHashBytes, '\0');
  EVP_Digest(token.data(), token.size(), reinterpret_cast<unsigned char*>(hash.data()), nullptr, EVP_sha256(), nullptr);
  return hash;
}

const PasswordHash& nobodys_hash() {
  static const PasswordHash hash{.salt = std::string(kSaltBytes, '\0'), .hash = {}};
  return hash;
}

void check_user_name(const std::string& name) {
  if (!is_name(name))
    throw InputError(
        fmt::format("found the name '{}', expected a lower-case letter, then at most {} of a-z, 0-9, '.', '_' and '-'",
                    shown_text(name), kLongestName - 1));
}

std::vector<User> read_users(const fs::path& file) {
  const std::string text = read_regular_file(file, kMostFileBytes, "the console's users");
  struct stat facts {};
  if (::stat(file.c_str(), &facts) == 0 && (facts.st_mode & 077) != 0)
    throw InputError(
        file, fmt::format("found mode {:04o}, expected 0600: chmod 600 {}", facts.st_mode & 07777, file.string()));
  std::vector<User> users;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream in(line.substr(0, line.find('#')));
    const std::vector<std::string> words{std::istream_iterator<std::string>(in), {}};
    if (words.empty()) continue;
    try {
      if (is_token(words)) {
        add_token(words, users);
        continue;
      }
      users.push_back(user_of(words));
    } catch (const InputError& e) {
      throw InputError(file, number, e.what());
    }
    if (std::ranges::count(users, users.back().name, &User::name) > 1)
      throw InputError(file, number, "found " + users.back().name + " twice, expected each user once");
  }
  return users;
}

void write_users(const fs::path& file, const std::vector<User>& users) {
  std::string text = fmt::format("# Users of `tankrig serve`: {}; of programs: {}\n", kLine, kTokenLine);
  for (const User& user : users) {
    text +=
        fmt::format("{} {} scrypt {} {} {} {} {}\n", user.name, name_of(user.role), user.password.log2_n,
                    user.password.r, user.password.p, hexadecimal(user.password.salt), hexadecimal(user.password.hash));
    for (const ApiToken& token : user.tokens)
      text += fmt::format("{} token {} {} sha256 {}\n", user.name, token.label, name_of(token.role),
                          hexadecimal(token.sha256));
  }
  UnfinishedFile fresh(file);
  if (::fchmod(fresh.descriptor(), S_IRUSR | S_IWUSR) != 0) throw CannotWrite(file, errno);
  std::string_view bytes = text;
  write_all(file, fresh.descriptor(), bytes);
  fresh.put_in_place_durably();
}

}  // namespace tankrig
