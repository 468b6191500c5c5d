#include "console/server/token_users.hpp"

#include <openssl/crypto.h>

#include <algorithm>
#include <cstdio>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

bool is_same(const struct stat& a, const struct stat& b) {
  return a.st_ino == b.st_ino && a.st_dev == b.st_dev && a.st_size == b.st_size && a.st_mode == b.st_mode &&
         a.st_mtim.tv_sec == b.st_mtim.tv_sec && a.st_mtim.tv_nsec == b.st_mtim.tv_nsec &&
         a.st_ctim.tv_sec == b.st_ctim.tv_sec && a.st_ctim.tv_nsec == b.st_ctim.tv_nsec;
}

}  // namespace

void TokenUsers::read_if_changed() {
  struct stat now {};
  if (::stat(file_.c_str(), &now) != 0) now = {};
  if (now.st_ino != 0 && is_same(now, read_)) return;
  const bool told = now.st_ino == 0 && read_.st_ino == 0 && users_.empty();
  read_ = now;
  users_.clear();
  try {
    users_ = read_users(file_);
  } catch (const InputError& e) {
    if (!told) std::fprintf(stderr, "tankrig: %s\n", printable(e.what()).c_str());
  }
}

std::optional<TokenUsers::Owner> TokenUsers::owner(std::string_view token) {
  read_if_changed();
  const std::string hash = token_hash(token);
  for (const User& user : users_)
    for (const ApiToken& known : user.tokens)
      if (known.sha256.size() == hash.size() && CRYPTO_memcmp(known.sha256.data(), hash.data(), hash.size()) == 0)
        return Owner{user.name, std::min(known.role, user.role)};
  return std::nullopt;
}

}  // namespace tankrig
