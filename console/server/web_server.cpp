#include "console/server/web_server.hpp"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cerrno>
#include <chrono>
#include <deque>
#include <limits>
#include <map>
#include <vector>

#include "console/server/access.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using namespace std::chrono_literals;
using Message = std::shared_ptr<const std::string>;

constexpr std::size_t kMostConnections = 256, kMostHeaderBytes = 16 << 10, kMostSaidBytes = 64 << 10;
constexpr std::size_t kMostWaitingBytes = 64 << 20;  // for one client
constexpr std::chrono::seconds kRequestTime = 30s, kReplyTime = 10min;
constexpr std::chrono::seconds kUploadTime = 15min, kUploadSilence = 20s;
constexpr std::size_t kPiece = 64 << 10, kDroppedBytes = 4 << 20;  // the latter are read so that a refusal is heard
constexpr auto kSilence = 1500ms;  // of a WebSocket; it is pinged when half of it is over

constexpr char kPolicy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

std::optional<int> hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return std::nullopt;
}

/// Nothing if it is no proper percent-encoding.
std::optional<std::string> decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out += text[i];
      continue;
    }
    const auto high = i + 2 < text.size() ? hex_digit(text[i + 1]) : std::nullopt;
    const auto low = i + 2 < text.size() ? hex_digit(text[i + 2]) : std::nullopt;
    if (!high || !low || 16 * *high + *low == 0) return std::nullopt;
    out += static_cast<char>(16 * *high + *low);
    i += 2;
  }
  return out;
}

/// "a=1&b=two", decoded; what is no proper percent-encoding is left out.
std::map<std::string, std::string> query_of(std::string_view target) {
  std::map<std::string, std::string> query;
  const std::size_t mark = target.find('?');
  std::string_view rest = mark == std::string_view::npos ? "" : target.substr(mark + 1);
  while (!rest.empty()) {
    const std::string_view one = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(one.size() + 1, rest.size()));
    const auto name = decoded(one.substr(0, one.find('='))),
               value = decoded(one.substr(std::min(one.find('='), one.size() - 1) + 1));
    if (name && value && one.find('=') != std::string_view::npos) query[*name] = *value;
  }
  return query;
}

template <class Body>
void add_headers(http::response<Body>& response, const WebReply& reply) {
  response.set(http::field::content_type, reply.type);
  response.set(http::field::cache_control, "no-store");
  response.set("Content-Security-Policy", reply.policy.empty() ? kPolicy : reply.policy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  if (!reply.download_as.empty())
    response.set(http::field::content_disposition, "attachment; filename=\"" + reply.download_as + "\"");
  if (reply.retry_after_s > 0) response.set(http::field::retry_after, std::to_string(reply.retry_after_s));
}

/// What waits to be sent to one client.
class Outbox {
 public:
  explicit Outbox(asio::io_context& io) : wake_(io, asio::steady_timer::time_point::max()) {}

  /// False if it is full.
  bool put(Message message, bool binary, const std::string& newest) {
    if (!newest.empty())
      for (Waiting& w : waiting_)
        if (w.newest == newest) {
          bytes_ += message->size() - w.message->size();
          w.message = std::move(message);
          return true;
        }
    bytes_ += message->size();
    waiting_.push_back({std::move(message), binary, newest});
    wake_.cancel();
    return bytes_ <= kMostWaitingBytes;
  }
  struct Waiting {
    Message message;
    bool binary;
    std::string newest;
  };
  std::optional<Waiting> take() {
    if (waiting_.empty()) return std::nullopt;
    Waiting first = std::move(waiting_.front());
    waiting_.pop_front();
    bytes_ -= first.message->size();
    return first;
  }
  asio::steady_timer& wake() { return wake_; }

 private:
  asio::steady_timer wake_;
  std::deque<Waiting> waiting_;
  std::size_t bytes_ = 0;
};

struct Client {
  Client(beast::tcp_stream stream, asio::io_context& io) : socket(std::move(stream)), outbox(io) {}
  websocket::stream<beast::tcp_stream> socket;
  Outbox outbox;
  bool gone = false;
};

}  // namespace

class WebServer::Implementation {
 public:
  Implementation(asio::io_context& io, std::uint16_t port, WebHandlers handlers)
      : io_(io), listener_(io), handlers_(std::move(handlers)), access_(listen(port)) {
    asio::co_spawn(io_, accept(), asio::detached);
  }

  std::string address() const { return access_.address(); }

  void send(ClientId id, const Message& message, bool binary, const std::string& newest) {
    if (const auto client = clients_.find(id); client != clients_.end()) put(*client->second, message, binary, newest);
  }
  void send_to_all(const Message& message, bool binary, const std::string& newest) {
    for (const auto& [id, client] : clients_) put(*client, message, binary, newest);
  }

 private:
  std::uint16_t listen(std::uint16_t port) {
    const tcp::endpoint here(asio::ip::address_v4::loopback(), port);
    error_code failure;
    listener_.open(here.protocol());
    listener_.set_option(tcp::acceptor::reuse_address(true));
    listener_.bind(here, failure);
    if (!failure) listener_.listen(asio::socket_base::max_listen_connections, failure);
    if (failure)
      throw InputError("--port: found " + std::to_string(port) + " (" + failure.message() +
                       "), expected one that is free");
    return listener_.local_endpoint().port();
  }

  static void put(Client& client, const Message& message, bool binary, const std::string& newest) {
    if (client.gone || client.outbox.put(message, binary, newest)) return;
    client.gone = true;
    beast::get_lowest_layer(client.socket).close();
  }

  asio::awaitable<void> accept() {
    while (true) {
      error_code failure;
      tcp::socket socket = co_await listener_.async_accept(asio::redirect_error(asio::use_awaitable, failure));
      if (failure == asio::error::operation_aborted) co_return;
      if (failure || connections_ >= kMostConnections) {
        asio::steady_timer pause(io_, 10ms);
        co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, failure));
        continue;
      }
      ++connections_;
      asio::co_spawn(io_, serve(beast::tcp_stream(std::move(socket))), [this](std::exception_ptr) { --connections_; });
    }
  }

  asio::awaitable<void> serve(beast::tcp_stream stream) {
    beast::flat_buffer buffer;
    for (bool open = true; open;) {
      http::request_parser<http::empty_body> parser;
      parser.header_limit(kMostHeaderBytes);
      parser.body_limit(std::numeric_limits<std::uint64_t>::max());  // nothing of it is read here
      stream.expires_after(kRequestTime);
      error_code failure;
      co_await http::async_read_header(stream, buffer, parser, asio::redirect_error(asio::use_awaitable, failure));
      if (failure) co_return;
      http::request<http::empty_body> request = parser.get();
      const bool upgrade = websocket::is_upgrade(request);
      const std::string refused =
          access_.refused({view(request[http::field::host]), view(request[http::field::origin]),
                           view(request[http::field::cookie]), upgrade, view(request[http::field::authorization])});
      const std::string_view target = view(request.target());
      if (upgrade && refused.empty() && target == "/live") {
        stream.expires_never();
        co_await talk(std::move(stream), request);
        co_return;
      }
      open = request.keep_alive() && parser.is_done();
      request.keep_alive(open);
      WebReply reply;
      if (const std::string_view key = "/?key="; target.starts_with(key) && access_.opens(target.substr(key.size())))
        open = co_await let_in(stream, request);
      else {
        if (!refused.empty())
          reply = {403, "text/plain; charset=utf-8", "Refused: " + refused + ".\n"};
        else if (request.method() == http::verb::post && handlers_.upload)
          reply = co_await receive(stream, buffer, parser);
        else if (request.method() != http::verb::get)
          reply = {405, "text/plain; charset=utf-8", "Only GET is served.\n"};
        else if (const auto path = decoded(target.substr(0, target.find('?'))))
          reply = co_await answer(*path);
        else
          reply = {400, "text/plain; charset=utf-8", "The address is no proper one.\n"};
        open = co_await write(stream, request, std::move(reply)) && open;
      }
    }
    error_code over;
    stream.socket().shutdown(tcp::socket::shutdown_send, over);
    stream.expires_after(2s);
    for (std::size_t dropped = 0; dropped < kDroppedBytes && !over;) {
      buffer.clear();
      dropped +=
          co_await stream.async_read_some(buffer.prepare(kPiece), asio::redirect_error(asio::use_awaitable, over));
    }
  }

  /// A POST; the only one of its connection.
  asio::awaitable<WebReply> receive(beast::tcp_stream& stream, beast::flat_buffer& buffer,
                                    http::request_parser<http::empty_body>& header) {
    const std::string_view target = view(header.get().target());
    error_code failure;
    WebUpload upload;
    upload.path = decoded(target.substr(0, target.find('?'))).value_or("");
    upload.query = query_of(target);
    upload.address = stream.socket().remote_endpoint(failure).address().to_string();
    if (const auto length = header.content_length()) upload.bytes = *length;
    WebUploadPlan plan = handlers_.upload(upload);
    if (!plan.received) co_return std::move(plan.refusal);
    if (upload.bytes.value_or(0) > plan.most) co_return too_large(plan.most);
    co_return co_await body_of(stream, buffer, header, plan);
  }

  static WebReply too_large(std::uint64_t most) {
    return {.status = 413, .body = "Found more bytes, expected at most " + std::to_string(most) + ".\n"};
  }

  /// Reads it to its file; says what is answered.
  static asio::awaitable<WebReply> body_of(beast::tcp_stream& stream, beast::flat_buffer& buffer,
                                           http::request_parser<http::empty_body>& header, WebUploadPlan& plan) {
    error_code failure;
    if (beast::iequals(header.get()[http::field::expect], "100-continue")) {
      http::response<http::empty_body> go_on{http::status::continue_, header.get().version()};
      co_await http::async_write(stream, go_on, asio::redirect_error(asio::use_awaitable, failure));
    }
    http::request_parser<http::buffer_body> body(std::move(header));
    body.body_limit(plan.most);
    std::vector<char> bytes(kPiece);
    const auto end = std::chrono::steady_clock::now() + kUploadTime;
    while (!failure && !body.is_done()) {
      body.get().body().data = bytes.data();
      body.get().body().size = bytes.size();
      stream.expires_at(std::min(end, std::chrono::steady_clock::now() + kUploadSilence));
      co_await http::async_read_some(stream, buffer, body, asio::redirect_error(asio::use_awaitable, failure));
      if (failure == http::error::need_buffer) failure = {};
      const char* from = bytes.data();
      for (std::size_t left = bytes.size() - body.get().body().size; left > 0;) {
        const ssize_t n = ::write(plan.file, from, left);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) co_return WebReply{.status = 507, .body = "The disk is full.\n"};
        from += n, left -= static_cast<std::size_t>(n);
      }
    }
    if (failure == http::error::body_limit) co_return too_large(plan.most);
    if (failure) co_return WebReply{.status = 400, .body = "The upload was cut short.\n"};
    co_return plan.received();
  }

  asio::awaitable<bool> let_in(beast::tcp_stream& stream, const http::request<http::empty_body>& request) {
    http::response<http::empty_body> response{http::status::see_other, request.version()};
    response.set(http::field::location, "/");
    response.set(http::field::set_cookie, access_.cookie());
    response.set(http::field::cache_control, "no-store");
    response.set("Referrer-Policy", "no-referrer");
    response.prepare_payload();
    error_code failure;
    co_await http::async_write(stream, response, asio::redirect_error(asio::use_awaitable, failure));
    co_return !failure;
  }

  /// Of whoever answers, now or later.
  asio::awaitable<WebReply> answer(const std::string& path) {
    struct Later {
      explicit Later(asio::io_context& io) : ready(io, asio::steady_timer::time_point::max()) {}
      asio::steady_timer ready;
      std::optional<WebReply> reply;
    };
    const auto later = std::make_shared<Later>(io_);
    handlers_.get(path, [later](WebReply reply) {
      later->reply = std::move(reply);
      later->ready.cancel();
    });
    error_code ignored;
    while (!later->reply) co_await later->ready.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    co_return std::move(*later->reply);
  }

  static asio::awaitable<bool> write(beast::tcp_stream& stream, const http::request<http::empty_body>& request,
                                     WebReply reply) {
    error_code failure;
    stream.expires_after(kReplyTime);
    if (reply.file >= 0) {
      http::response<http::file_body> response{static_cast<http::status>(reply.status), request.version()};
      beast::file_posix file;
      file.native_handle(reply.file);
      response.body().reset(std::move(file), failure);
      add_headers(response, reply);
      response.keep_alive(request.keep_alive());
      response.prepare_payload();
      if (!failure) co_await http::async_write(stream, response, asio::redirect_error(asio::use_awaitable, failure));
    } else {
      http::response<http::string_body> response{static_cast<http::status>(reply.status), request.version()};
      add_headers(response, reply);
      response.keep_alive(request.keep_alive());
      response.body() = std::move(reply.body);
      response.prepare_payload();
      co_await http::async_write(stream, response, asio::redirect_error(asio::use_awaitable, failure));
    }
    co_return !failure;
  }

  asio::awaitable<void> talk(beast::tcp_stream stream, http::request<http::empty_body> request) {
    const auto client = std::make_shared<Client>(std::move(stream), io_);
    client->socket.set_option(websocket::stream_base::timeout{5s, kSilence, true});
    client->socket.read_message_max(kMostSaidBytes);
    client->socket.auto_fragment(false);
    error_code failure;
    co_await client->socket.async_accept(request, asio::redirect_error(asio::use_awaitable, failure));
    if (failure) co_return;
    const ClientId id = ++last_id_;
    clients_[id] = client;
    handlers_.joined(id);
    asio::co_spawn(io_, send_what_waits(client), asio::detached);
    beast::flat_buffer buffer;
    while (!client->gone) {
      co_await client->socket.async_read(buffer, asio::redirect_error(asio::use_awaitable, failure));
      if (failure) break;
      if (client->socket.got_text()) handlers_.said(id, beast::buffers_to_string(buffer.data()));
      buffer.consume(buffer.size());
    }
    client->gone = true;
    client->outbox.wake().cancel();
    clients_.erase(id);
    handlers_.left(id);
  }

  static asio::awaitable<void> send_what_waits(std::shared_ptr<Client> client) {
    error_code failure;
    while (!client->gone) {
      const auto next = client->outbox.take();
      if (!next) {
        co_await client->outbox.wake().async_wait(asio::redirect_error(asio::use_awaitable, failure));
        continue;
      }
      client->socket.binary(next->binary);
      co_await client->socket.async_write(asio::buffer(*next->message),
                                          asio::redirect_error(asio::use_awaitable, failure));
      if (failure) co_return;
    }
  }

  asio::io_context& io_;
  tcp::acceptor listener_;
  WebHandlers handlers_;
  Access access_;
  std::map<ClientId, std::shared_ptr<Client>> clients_;
  ClientId last_id_ = 0;
  std::size_t connections_ = 0;
};

WebServer::WebServer(asio::io_context& io, std::uint16_t port, WebHandlers handlers)
    : implementation_(std::make_unique<Implementation>(io, port, std::move(handlers))) {}
WebServer::~WebServer() = default;
std::string WebServer::address() const { return implementation_->address(); }
void WebServer::send(ClientId client, std::shared_ptr<const std::string> message, bool binary,
                     const std::string& newest) {
  implementation_->send(client, message, binary, newest);
}
void WebServer::send_to_all(std::shared_ptr<const std::string> message, bool binary, const std::string& newest) {
  implementation_->send_to_all(message, binary, newest);
}

}  // namespace tankrig
