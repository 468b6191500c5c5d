#include "console/server/stream.hpp"

#include <boost/asio/ssl/context.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>

namespace tankrig {

namespace asio = boost::asio;

struct Stream::Secure : boost::beast::ssl_stream<Plain> {
  using boost::beast::ssl_stream<Plain>::ssl_stream;
};

Stream::Stream(Socket socket) : plain_(std::make_unique<Plain>(std::move(socket))) {}
Stream::Stream(Socket socket, asio::ssl::context& tls) : secure_(std::make_unique<Secure>(std::move(socket), tls)) {}
Stream::Stream(Stream&&) noexcept = default;
Stream::~Stream() = default;

Stream::Plain& Stream::tcp() { return secure_ ? secure_->next_layer() : *plain_; }

void Stream::handshake(Ended ended) { secure_->async_handshake(asio::ssl::stream_base::server, std::move(ended)); }

void Stream::read_some(std::vector<asio::mutable_buffer> buffers, Transferred transferred) {
  if (secure_)
    secure_->async_read_some(buffers, std::move(transferred));
  else
    plain_->async_read_some(buffers, std::move(transferred));
}

void Stream::write_some(std::vector<asio::const_buffer> buffers, Transferred transferred) {
  if (secure_)
    secure_->async_write_some(buffers, std::move(transferred));
  else
    plain_->async_write_some(buffers, std::move(transferred));
}

void Stream::teardown(boost::beast::role_type role, Ended ended) {
  using boost::beast::websocket::async_teardown;
  if (secure_)
    async_teardown(role, static_cast<boost::beast::ssl_stream<Plain>&>(*secure_), std::move(ended));
  else
    async_teardown(role, plain_->socket(), std::move(ended));
}

}  // namespace tankrig
