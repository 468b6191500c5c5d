#include "console/server/access.hpp"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <sys/random.h>

#include <algorithm>
#include <array>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

constexpr std::size_t kKeyBytes = 16;
constexpr int kMostSessions = 16;  // of one user
constexpr std::chrono::hours kSessionTime{12};

/// Cookies are shared by all ports of a host: each console has a name of its own.
std::string cookie_name(std::uint16_t port) { return fmt::format("tankrig_{}", port); }

std::string random_key() {
  std::array<unsigned char, kKeyBytes> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw InputError("console: no random numbers from the system, expected some for its key");
  std::string key;
  for (const unsigned char byte : bytes) key += fmt::format("{:02x}", byte);
  return key;
}

/// As an address of the web has it.
std::string bracketed(std::string_view address) {
  return address.find(':') == std::string_view::npos ? std::string(address) : fmt::format("[{}]", address);
}

/// As fast for a near miss as for any other.
bool same(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string_view cookie_of(std::string_view cookies, std::string_view name) {
  while (!cookies.empty()) {
    const std::size_t end = cookies.find(';');
    std::string_view one = cookies.substr(0, end);
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (one.starts_with(name) && one.substr(name.size()).starts_with('=')) return one.substr(name.size() + 1);
    cookies = end == std::string_view::npos ? std::string_view{} : cookies.substr(end + 1);
  }
  return {};
}

}  // namespace

bool is_loopback(std::string_view address) { return address.starts_with("127.") || address == "::1"; }

Access::Access(ListenOptions options, std::uint16_t port)
    : options_(std::move(options)), port_(port), key_(has_users() ? "" : random_key()), tokens_(options_.users) {
  if (!has_users())
    sessions_.push_back(
        {key_, std::make_shared<BrowserSession>("", Role::kAdminister, BrowserSession::Clock::time_point::max())});
}

bool Access::opens(std::string_view key) const { return !key_.empty() && same(key_, key); }

std::string Access::address() const {
  const bool everywhere = options_.address == "0.0.0.0" || options_.address == "::";
  const std::string name = !options_.names.empty() ? options_.names.front()
                           : everywhere            ? "localhost"
                                                   : bracketed(options_.address);
  return fmt::format("{}://{}:{}/{}", options_.tls_certificate.empty() ? "http" : "https", name, port_,
                     has_users() ? "" : "?key=" + key_);
}

std::string Access::refused(const RequestHeaders& request) const {
  const bool tls = !options_.tls_certificate.empty();
  std::vector<std::string> names = options_.names;
  names.push_back(bracketed(request.here));
  if (is_loopback(request.here)) names.push_back("localhost");
  const bool usual_port = port_ == (tls ? 443 : 80);
  const bool known = std::ranges::any_of(names, [&](const std::string& name) {
    return request.host == fmt::format("{}:{}", name, port_) || (usual_port && request.host == name);
  });
  if (!known) return "asked for under a name that is not this machine's";
  if (request.origin.empty()) return request.upgrade ? "a WebSocket without a page" : "";
  return request.origin == fmt::format("{}://{}", tls ? "https" : "http", request.host)
             ? ""
             : "asked by another site's page";
}

std::shared_ptr<BrowserSession> Access::session(const RequestHeaders& request) {
  constexpr std::string_view kBearer = "Bearer ";
  const bool bears = request.authorization.starts_with(kBearer);
  const std::string_view given =
      bears ? request.authorization.substr(kBearer.size()) : cookie_of(request.cookie, cookie_name(port_));
  if (bears && has_users()) {
    if (request.upgrade) return nullptr;
    const auto owner = tokens_.owner(given);
    return owner ? std::make_shared<BrowserSession>(owner->name, owner->role, BrowserSession::Clock::time_point::max())
                 : nullptr;
  }
  const auto found = std::ranges::find_if(sessions_, [&](const Entry& entry) { return same(entry.token, given); });
  return found == sessions_.end() || found->session->over() ? nullptr : found->session;
}

std::string Access::let_in(const std::string& name, Role role) {
  std::erase_if(sessions_, [](const Entry& entry) { return entry.session->over(); });
  const auto is_theirs = [&](const Entry& entry) { return entry.session->name() == name; };
  if (std::ranges::count_if(sessions_, is_theirs) >= kMostSessions) {
    const auto oldest = std::ranges::find_if(sessions_, is_theirs);
    oldest->session->end();
    sessions_.erase(oldest);
  }
  sessions_.push_back(
      {random_key(), std::make_shared<BrowserSession>(name, role, BrowserSession::Clock::now() + kSessionTime)});
  return cookie(sessions_.back().token);
}

std::string Access::cookie(const std::string& token) const {
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict{}", cookie_name(port_), token,
                     options_.tls_certificate.empty() ? "" : "; Secure");
}

}  // namespace tankrig
