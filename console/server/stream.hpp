// A browser's connection, plain or by TLS, as Beast takes either.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace boost::asio::ssl {
class context;
}

namespace tankrig {

/// One type for both. Whoever waits for it is called through a std::function, so that the operations below are compiled once
/// (stream.cpp) and do not become part of the types above.
class Stream {
  using Plain = boost::beast::tcp_stream;
  using Failure = boost::system::error_code;
  using Ended = std::function<void(Failure)>;
  using Transferred = std::function<void(Failure, std::size_t)>;

 public:
  using executor_type = Plain::executor_type;
  using Socket = Plain::socket_type;

  explicit Stream(Socket socket);
  Stream(Socket socket, boost::asio::ssl::context& tls);
  Stream(Stream&&) noexcept;
  ~Stream();

  executor_type get_executor() { return tcp().get_executor(); }
  Socket& socket() { return tcp().socket(); }
  void expires_after(std::chrono::steady_clock::duration time) { tcp().expires_after(time); }
  void expires_never() { tcp().expires_never(); }
  void close() { tcp().close(); }
  bool secure() const { return secure_ != nullptr; }

  template <class Token>
  auto async_handshake(Token&& token) {
    return boost::asio::async_initiate<Token, void(Failure)>(
        [this](auto handler) { handshake(called<Ended>(std::move(handler))); }, token);
  }
  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(Failure, std::size_t)>(
        [this](auto handler, const Buffers& all) {
          read_some({boost::asio::buffer_sequence_begin(all), boost::asio::buffer_sequence_end(all)},
                    called<Transferred>(std::move(handler)));
        },
        token, buffers);
  }
  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(Failure, std::size_t)>(
        [this](auto handler, const Buffers& all) {
          write_some({boost::asio::buffer_sequence_begin(all), boost::asio::buffer_sequence_end(all)},
                     called<Transferred>(std::move(handler)));
        },
        token, buffers);
  }

  // As a WebSocket ends.
  friend void beast_close_socket(Stream& stream) { stream.close(); }
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, Stream& stream, Handler&& handler) {
    stream.teardown(role, called<Ended>(std::forward<Handler>(handler)));
  }

 private:
  struct Secure;

  /// A handler can be moved only, a std::function is copied.
  template <class Function, class Handler>
  static Function called(Handler handler) {
    return [kept = std::make_shared<Handler>(std::move(handler))](auto... result) { std::move (*kept)(result...); };
  }
  void handshake(Ended ended);
  void read_some(std::vector<boost::asio::mutable_buffer> buffers, Transferred transferred);
  void write_some(std::vector<boost::asio::const_buffer> buffers, Transferred transferred);
  void teardown(boost::beast::role_type role, Ended ended);
  Plain& tcp();

  std::unique_ptr<Plain> plain_;    // either this
  std::unique_ptr<Secure> secure_;  // or this
};

}  // namespace tankrig
