#include "console/server/access.hpp"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <sys/random.h>

#include <array>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kKeyBytes = 16;

/// Cookies are shared by all ports of a host: each console has a name of its own.
std::string cookie_name(std::uint16_t port) { return fmt::format("tankrig_{}", port); }

}  // namespace

Access::Access(std::uint16_t port) : port_(port) {
  std::array<unsigned char, kKeyBytes> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw InputError("console: no random numbers from the system, expected some for its key");
  for (const unsigned char byte : bytes) key_ += fmt::format("{:02x}", byte);
}

std::string Access::address() const { return fmt::format("http://127.0.0.1:{}/?key={}", port_, key_); }

bool Access::opens(std::string_view key) const {
  return key.size() == key_.size() && CRYPTO_memcmp(key.data(), key_.data(), key_.size()) == 0;
}

std::string Access::cookie() const {
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict", cookie_name(port_), key_);
}

std::string Access::refused(const RequestHeaders& request) const {
  bool known = false;
  for (const char* name : {"127.0.0.1", "localhost"}) {
    const std::string host = fmt::format("{}:{}", name, port_);
    known = known || request.host == host;
    if (request.host == host && !request.origin.empty() && request.origin != "http://" + host)
      return "asked by another site's page";
  }
  if (!known) return "asked for under a name that is not this machine's";
  if (request.upgrade && request.origin.empty()) return "a WebSocket without a page";
  constexpr std::string_view kBearer = "Bearer ";
  if (request.authorization.starts_with(kBearer) && opens(request.authorization.substr(kBearer.size()))) return {};
  const std::string wanted = cookie_name(port_) + "=";
  std::string_view rest = request.cookie;
  while (!rest.empty()) {
    const std::size_t end = rest.find(';');
    std::string_view one = rest.substr(0, end);
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (one.starts_with(wanted) && opens(one.substr(wanted.size()))) return {};
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  }
  return "without this console's key: open the address that `tankrig serve` printed";
}

}  // namespace tankrig
