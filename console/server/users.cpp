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
constexpr char kLine[] = "NAME ROLE scrypt LOG2_N R P SALT HASH";

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

/// Errors: InputError without the line's number; a password's hash is not shown.
User user_of(const std::vector<std::string>& words) {
  if (words.size() != 8) throw InputError(fmt::format("found {} words, expected {}", words.size(), kLine));
  User user;
  check_user_name(user.name = words[0]);
  const auto role = std::ranges::find(kNames<Role>, words[1]);
  if (role == kNames<Role>.end())
    throw InputError(
        fmt::format("found the role '{}', expected one of: {}", shown_text(words[1]), fmt::join(kNames<Role>, ", ")));
  user.role = static_cast<Role>(role - kNames<Role>.begin());
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
  std::string text = fmt::format("# Users of `tankrig serve`: {}\n", kLine);
  for (const User& user : users)
    text +=
        fmt::format("{} {} scrypt {} {} {} {} {}\n", user.name, name_of(user.role), user.password.log2_n,
                    user.password.r, user.password.p, hexadecimal(user.password.salt), hexadecimal(user.password.hash));
  UnfinishedFile fresh(file);
  if (::fchmod(fresh.descriptor(), S_IRUSR | S_IWUSR) != 0) throw CannotWrite(file, errno);
  std::string_view bytes = text;
  write_all(file, fresh.descriptor(), bytes);
  fresh.put_in_place_durably();
}

}  // namespace tankrig
