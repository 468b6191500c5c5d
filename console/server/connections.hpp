// Connections of browsers: TLS, the messages of HTTP, WebSockets. Boost.Beast is included by connections.cpp alone, so that a change of
// what is answered does not compile it anew.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "console/server/control.hpp"
#include "console/server/web_messages.hpp"

namespace tankrig {

/// Called in the thread of the io_context.
struct ConnectionHandlers {
  std::function<WebAnswer(const WebRequest&)> asked;
  std::function<void(ClientId)> joined, left;  ///< a WebSocket
  std::function<void(ClientId, const std::string& text)> said;
};

/// A client that hears nothing, and a connection that is broken, are gone within a second and a half.
class Connections {
 public:
  /// Listens from now on.
  /// Errors: InputError if the address or port cannot be had, or the certificate or its key cannot be used.
  Connections(boost::asio::io_context& io, const ListenOptions& options, ConnectionHandlers handlers);
  ~Connections();
  Connections(const Connections&) = delete;
  Connections& operator=(const Connections&) = delete;

  std::uint16_t port() const;
  /// Of a client that is there.
  const BrowserSession& session(ClientId client) const;
  /// Clients whose session is over are let go.
  void end_talks();

  /// One WebSocket message to one client or to all. `newest`: of several with this name that wait, only the newest is
  /// sent; empty: all are. A client that takes nothing is let go.
  void send(ClientId client, const std::shared_ptr<const std::string>& message, bool binary,
            const std::string& newest = {});
  void send_to_all(const std::shared_ptr<const std::string>& message, bool binary, const std::string& newest = {});

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace tankrig
