// Who may ask the console anything: whoever has its key, from a page of its own.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tankrig {

/// What a request says of itself.
struct RequestHeaders {
  std::string_view host, origin, cookie;
  bool upgrade = false;                 ///< to a WebSocket
  std::string_view authorization = {};  ///< "Bearer KEY", of a program without cookies
};

/// A random key of this run; a browser keeps it as a cookie, which scripts cannot read and other sites cannot send.
class Access {
 public:
  /// Errors: InputError if the system has no random numbers.
  explicit Access(std::uint16_t port);

  const std::string& key() const { return key_; }
  /// The address that lets a browser in.
  std::string address() const;
  bool opens(std::string_view key) const;
  /// The value of Set-Cookie.
  std::string cookie() const;
  /// Empty, or why not: a name that is not this machine's (DNS rebinding), another site's page, or no key.
  std::string refused(const RequestHeaders& request) const;

 private:
  const std::uint16_t port_;
  std::string key_;
};

}  // namespace tankrig
