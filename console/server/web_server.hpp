// HTTP and WebSocket for the console's pages, with or without TLS: who asks, how often, and what the asker may do.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "console/server/access.hpp"
#include "console/server/control.hpp"

namespace tankrig {

struct WebReply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body = {};
  int file = -1;                           ///< an open regular file instead of a body; closed by the server
  std::string policy = {};                 ///< Content-Security-Policy; empty: the console's own
  std::string download_as = {};            ///< a plain file name; empty: shown
  std::string location = {}, cookie = {};  ///< of their headers; empty: none
  int retry_after_s = 0;                   ///< 0: not said
};

/// A POST whose body has not been read.
struct WebUpload {
  std::string path;                          ///< decoded, without the query
  std::map<std::string, std::string> query;  ///< decoded
  std::string user, address;                 ///< who sends it
  std::optional<std::uint64_t> bytes;        ///< as it declares
};

/// What becomes of it.
struct WebUploadPlan {
  WebReply refusal = {};   ///< sent at once, with the body unread, if there is no `received`
  int file = -1;           ///< where the body is written to; stays open and is closed by whoever `received` belongs to
  std::uint64_t most = 0;  ///< bytes; beyond them 413
  std::function<WebReply()> received = {};  ///< called when all is there; destroyed without a call if it never is
};

/// Called in the thread of the io_context.
struct WebHandlers {
  /// `path`: decoded, without the query. `reply` may be called later, once.
  std::function<void(const std::string& path, std::function<void(WebReply)> reply)> get;
  std::function<void(ClientId)> joined, left;
  std::function<void(ClientId, const std::string& text)> said;
  std::function<WebUploadPlan(const WebUpload&)> upload = {};  ///< none: nothing can be sent
};

/// A client that hears nothing, and a connection that is broken, are gone within a second and a half.
class WebServer {
 public:
  /// Errors: InputError if the address or port cannot be had, or the certificate, its key or the users' file cannot be
  /// used.
  WebServer(boost::asio::io_context& io, const ListenOptions& options, WebHandlers handlers);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// For a browser; with the key, if that lets in.
  std::string address() const;
  /// Of a client that is there: who it is, and may do what.
  const BrowserSession& session(ClientId client) const;

  /// One WebSocket message to one client or to all. `newest`: of several with this name that wait, only the newest is
  /// sent; empty: all are. A client that takes nothing is let go.
  void send(ClientId client, std::shared_ptr<const std::string> message, bool binary, const std::string& newest = {});
  void send_to_all(std::shared_ptr<const std::string> message, bool binary, const std::string& newest = {});

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace tankrig
