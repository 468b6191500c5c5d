// Who may ask the console anything: whoever has its key or is one of its users, from a page of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "console/server/roles.hpp"
#include "console/server/token_users.hpp"

namespace tankrig {

/// Where to listen, and for whom.
struct ListenOptions {
  std::string address = "127.0.0.1";    ///< of IPv4 or IPv6, without brackets
  std::uint16_t port = 8080;            ///< 0: any that is free
  std::vector<std::string> names = {};  ///< under which browsers may ask, besides the address itself
  std::filesystem::path users = {};     ///< empty: whoever has the printed key may do everything
  std::filesystem::path tls_certificate = {}, tls_key = {};  ///< PEM; empty: without TLS
};

/// Whether only this machine reaches it.
bool is_loopback(std::string_view address);

/// What a request says of itself.
struct RequestHeaders {
  std::string_view host, origin, cookie;
  bool upgrade = false;                 ///< to a WebSocket
  std::string_view authorization = {};  ///< "Bearer KEY" or "Bearer TOKEN", of a program without cookies
  std::string_view here = "127.0.0.1";  ///< this end of its connection
};

/// What one browser has been let in with, or what one request of a program may do.
class BrowserSession {
 public:
  using Clock = std::chrono::steady_clock;
  BrowserSession(std::string name, Role role, Clock::time_point end) : name_(std::move(name)), role_(role), end_(end) {}

  const std::string& name() const { return name_; }  ///< of the user; empty: of whoever has the key
  Role role() const { return role_; }
  bool over(Clock::time_point now = Clock::now()) const { return now >= end_; }
  void end() { end_ = Clock::time_point::min(); }

 private:
  std::string name_;
  Role role_;
  Clock::time_point end_;
};

/// A browser keeps a random key as a cookie, which scripts cannot read and other sites cannot send.
class Access {
 public:
  /// `port`: on which it listens.
  /// Errors: InputError if the system has no random numbers.
  Access(ListenOptions options, std::uint16_t port);

  bool has_users() const { return !options_.users.empty(); }
  /// Where there are no users: what lets in whoever has it.
  const std::string& key() const { return key_; }
  bool opens(std::string_view key) const;
  /// For a browser; with the key, if that lets in.
  std::string address() const;

  /// Empty, or why not: a name that is not this machine's (DNS rebinding), or another site's page.
  std::string refused(const RequestHeaders& request) const;
  /// Null: not let in. A token is good for one request, and for no WebSocket: so nothing of a revoked one goes on.
  std::shared_ptr<BrowserSession> session(const RequestHeaders& request);
  /// A user who has given the password, for twelve hours; of many of one user the oldest ends. The value of Set-Cookie.
  std::string let_in(const std::string& name, Role role);
  /// The same of whoever has the key.
  std::string let_in() const { return cookie(key_); }

 private:
  std::string cookie(const std::string& token) const;

  const ListenOptions options_;
  const std::uint16_t port_;
  std::string key_;
  struct Entry {
    std::string token;
    std::shared_ptr<BrowserSession> session;
  };
  std::vector<Entry> sessions_;
  TokenUsers tokens_;
};

}  // namespace tankrig
