// A browser's connection, plain or by TLS, as Beast takes either.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <chrono>
#include <memory>
#include <utility>

namespace tankrig {

/// One type for both, so that what is built on it is compiled once.
class Stream {
  using Plain = boost::beast::tcp_stream;
  using Secure = boost::beast::ssl_stream<Plain>;

 public:
  using executor_type = Plain::executor_type;
  using Socket = Plain::socket_type;

  explicit Stream(Socket socket) : plain_(std::make_unique<Plain>(std::move(socket))) {}
  Stream(Socket socket, boost::asio::ssl::context& tls) : secure_(std::make_unique<Secure>(std::move(socket), tls)) {}

  executor_type get_executor() { return tcp().get_executor(); }
  Socket& socket() { return tcp().socket(); }
  void expires_after(std::chrono::steady_clock::duration time) { tcp().expires_after(time); }
  void expires_never() { tcp().expires_never(); }
  void close() { tcp().close(); }
  bool secure() const { return secure_ != nullptr; }

  template <class Token>
  auto async_handshake(Token&& token) {
    return secure_->async_handshake(boost::asio::ssl::stream_base::server, std::forward<Token>(token));
  }
  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return secure_ ? secure_->async_read_some(buffers, std::forward<Token>(token))
                   : plain_->async_read_some(buffers, std::forward<Token>(token));
  }
  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return secure_ ? secure_->async_write_some(buffers, std::forward<Token>(token))
                   : plain_->async_write_some(buffers, std::forward<Token>(token));
  }

  // As a WebSocket ends.
  friend void beast_close_socket(Stream& stream) { stream.close(); }
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, Stream& stream, Handler&& handler) {
    using boost::beast::websocket::async_teardown;
    if (stream.secure_)
      async_teardown(role, *stream.secure_, std::forward<Handler>(handler));
    else
      async_teardown(role, stream.plain_->socket(), std::forward<Handler>(handler));
  }

 private:
  Plain& tcp() { return secure_ ? secure_->next_layer() : *plain_; }

  std::unique_ptr<Plain> plain_;    // either this
  std::unique_ptr<Secure> secure_;  // or this
};

}  // namespace tankrig
