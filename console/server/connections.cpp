#include "console/server/connections.hpp"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cerrno>
#include <cstdio>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "console/server/counted_address.hpp"
#include "console/server/stream.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

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

constexpr std::size_t kMostConnections = 256, kMostOfOneAddress = 192, kMostHeaderBytes = 16 << 10,
                      kMostSaidBytes = 64 << 10;
constexpr std::size_t kMostWaitingBytes = 64 << 20;  // for one client
constexpr std::chrono::seconds kHandshakeTime = 5s, kRequestTime = 30s, kReplyTime = 10min;
constexpr std::chrono::seconds kPieceTime = 1min;
constexpr std::size_t kPiece = 64 << 10, kDroppedBytes = 4 << 20;  // the latter are read so that a refusal is heard
constexpr auto kSilence = 1500ms;  // of a WebSocket; it is pinged when half of it is over

constexpr char kPolicy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

WebRequest::Method method_of(http::verb verb) {
  if (verb == http::verb::get) return WebRequest::Method::kGet;
  return verb == http::verb::post ? WebRequest::Method::kPost : WebRequest::Method::kOther;
}

template <class Body>
void add_headers(http::response<Body>& response, const WebReply& reply) {
  response.set(http::field::content_type, reply.type);
  response.set(http::field::cache_control, "no-store");
  response.set("Content-Security-Policy", reply.policy.empty() ? kPolicy : reply.policy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "same-origin");  // without a referrer a form's Origin is null
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  if (!reply.download_as.empty())
    response.set(http::field::content_disposition, "attachment; filename=\"" + reply.download_as + "\"");
  if (reply.retry_after_s > 0) response.set(http::field::retry_after, std::to_string(reply.retry_after_s));
  if (!reply.location.empty()) response.set(http::field::location, reply.location);
  if (!reply.cookie.empty()) response.set(http::field::set_cookie, reply.cookie);
}

/// Errors: InputError if the certificate or its key cannot be used.
asio::ssl::context tls_context(const ListenOptions& options) {
  asio::ssl::context tls(asio::ssl::context::tls_server);
  tls.set_options(asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1 | asio::ssl::context::no_compression);
  error_code failure;
  tls.use_certificate_chain_file(options.tls_certificate.string(), failure);
  if (failure)
    throw InputError(options.tls_certificate, failure.message() + ", expected a certificate in PEM (--tls-cert)");
  tls.use_private_key_file(options.tls_key.string(), asio::ssl::context::pem, failure);
  if (failure)
    throw InputError(options.tls_key, failure.message() + ", expected the certificate's key in PEM (--tls-key)");
  return tls;
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
  Client(Stream stream, std::shared_ptr<BrowserSession> of, asio::io_context& io)
      : socket(std::move(stream)), session(std::move(of)), outbox(io) {}
  websocket::stream<Stream> socket;
  std::shared_ptr<BrowserSession> session;
  Outbox outbox;
  bool gone = false;
};

}  // namespace

class Connections::Implementation {
 public:
  Implementation(asio::io_context& io, const ListenOptions& options, ConnectionHandlers handlers)
      : io_(io), listener_(io), handlers_(std::move(handlers)) {
    listen(options);
    if (!options.tls_certificate.empty()) tls_ = tls_context(options);
    asio::co_spawn(io_, accept(), asio::detached);
  }

  std::uint16_t port() const { return listener_.local_endpoint().port(); }
  const BrowserSession& session(ClientId id) const { return *clients_.at(id)->session; }
  void end_talks() {
    for (const auto& [id, client] : clients_)
      if (client->session->over()) let_go(*client);
  }

  void send(ClientId id, const Message& message, bool binary, const std::string& newest) {
    if (const auto client = clients_.find(id); client != clients_.end()) put(*client->second, message, binary, newest);
  }
  void send_to_all(const Message& message, bool binary, const std::string& newest) {
    for (const auto& [id, client] : clients_) put(*client, message, binary, newest);
  }

 private:
  void listen(const ListenOptions& options) {
    error_code failure;
    const asio::ip::address address = asio::ip::make_address(options.address, failure);
    const tcp::endpoint here(address, options.port);
    if (!failure) listener_.open(here.protocol(), failure);
    if (!failure) listener_.set_option(tcp::acceptor::reuse_address(true));
    if (!failure && address.is_v6()) listener_.set_option(asio::ip::v6_only(true));
    if (!failure) listener_.bind(here, failure);
    if (!failure) listener_.listen(asio::socket_base::max_listen_connections, failure);
    if (failure)
      throw InputError("--listen: found " + options.address + ", port " + std::to_string(options.port) + " (" +
                       failure.message() + "), expected an address of this machine and a port that is free");
  }

  static void put(Client& client, const Message& message, bool binary, const std::string& newest) {
    if (client.gone || (!client.session->over() && client.outbox.put(message, binary, newest))) return;
    let_go(client);
  }

  static void let_go(Client& client) {
    client.gone = true;
    client.outbox.wake().cancel();
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
      const tcp::endpoint peer = socket.remote_endpoint(failure);
      if (failure) continue;
      const std::string address = counted_address(peer.address());
      std::size_t& of_address = connections_of_[address];
      if (of_address >= kMostOfOneAddress) continue;
      ++of_address, ++connections_;
      Stream stream = tls_ ? Stream(std::move(socket), *tls_) : Stream(std::move(socket));
      asio::co_spawn(io_, greet(std::move(stream), address), [this, address](std::exception_ptr) {
        --connections_;
        if (--connections_of_[address] == 0) connections_of_.erase(address);
      });
    }
  }

  asio::awaitable<void> greet(Stream stream, std::string address) {
    error_code failure;
    stream.expires_after(kHandshakeTime);
    if (stream.secure()) co_await stream.async_handshake(asio::redirect_error(asio::use_awaitable, failure));
    if (!failure) co_await serve(std::move(stream), address);
  }

  asio::awaitable<void> serve(Stream stream, const std::string& address) {
    beast::flat_buffer buffer;
    const std::string here = stream.socket().local_endpoint().address().to_string();
    for (bool open = true; open;) {
      http::request_parser<http::empty_body> parser;
      parser.header_limit(kMostHeaderBytes);
      parser.body_limit(std::numeric_limits<std::uint64_t>::max());  // nothing of it is read here
      stream.expires_after(kRequestTime);
      error_code failure;
      co_await http::async_read_header(stream, buffer, parser, asio::redirect_error(asio::use_awaitable, failure));
      if (failure) co_return;
      http::request<http::empty_body> request = parser.get();
      WebRequest asked{
          method_of(request.method()),
          view(request.target()),
          {view(request[http::field::host]), view(request[http::field::origin]), view(request[http::field::cookie]),
           websocket::is_upgrade(request), view(request[http::field::authorization]), here},
          address,
          {}};
      if (const auto length = parser.content_length()) asked.bytes = *length;
      WebAnswer answer = handlers_.asked(asked);
      if (const auto* wanted = std::get_if<WebTalk>(&answer)) {
        stream.expires_never();
        co_await talk(std::move(stream), request, wanted->session);
        co_return;
      }
      open = request.keep_alive() && parser.is_done();
      request.keep_alive(open);
      WebReply reply = co_await reply_of(std::move(answer), stream, buffer, parser);
      open = co_await write(stream, request, std::move(reply)) && open;
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

  /// The answer is gone when the reply is known, and whoever waits for the upload's end hears of it.
  asio::awaitable<WebReply> reply_of(WebAnswer answer, Stream& stream, beast::flat_buffer& buffer,
                                     http::request_parser<http::empty_body>& header) {
    if (auto* reply = std::get_if<WebReply>(&answer)) co_return std::move(*reply);
    if (const auto* ask = std::get_if<AskForReply>(&answer)) co_return co_await reply_to(*ask);
    if (const auto* form = std::get_if<WebForm>(&answer)) {
      const std::optional<std::string> body = co_await text_of(stream, buffer, header, form->most);
      const AskForReply ask = [&](SendReply reply) { form->received(body, std::move(reply)); };
      co_return co_await reply_to(ask);
    }
    auto& plan = std::get<WebUploadPlan>(answer);
    if (!plan.received) co_return std::move(plan.refusal);
    if (const auto length = header.content_length(); length && *length > plan.most) co_return too_large(plan.most);
    co_return co_await body_of(stream, buffer, header, plan);
  }

  static asio::awaitable<std::optional<std::string>> text_of(Stream& stream, beast::flat_buffer& buffer,
                                                             http::request_parser<http::empty_body>& header,
                                                             std::size_t most) {
    error_code failure;
    http::request_parser<http::string_body> form(std::move(header));
    form.body_limit(most);
    co_await http::async_read(stream, buffer, form, asio::redirect_error(asio::use_awaitable, failure));
    if (failure) co_return std::nullopt;
    co_return std::move(form.get().body());
  }

  static WebReply too_large(std::uint64_t most) {
    return {.status = 413, .body = "Found more bytes, expected at most " + std::to_string(most) + ".\n"};
  }

  /// Reads it to its file; says what is answered.
  asio::awaitable<WebReply> body_of(Stream& stream, beast::flat_buffer& buffer,
                                    http::request_parser<http::empty_body>& header, WebUploadPlan& plan) {
    error_code failure;
    if (beast::iequals(header.get()[http::field::expect], "100-continue")) {
      http::response<http::empty_body> go_on{http::status::continue_, header.get().version()};
      co_await http::async_write(stream, go_on, asio::redirect_error(asio::use_awaitable, failure));
    }
    http::request_parser<http::buffer_body> body(std::move(header));
    body.body_limit(plan.most);
    std::vector<char> bytes(kPiece);
    const auto end = std::chrono::steady_clock::now() + plan.longest;
    while (!failure && !body.is_done()) {
      body.get().body().data = bytes.data();
      body.get().body().size = bytes.size();
      stream.expires_after(
          std::min<std::chrono::steady_clock::duration>(end - std::chrono::steady_clock::now(), plan.silence));
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
    co_return co_await reply_to(plan.received);
  }

  /// Of whoever answers, now or later.
  asio::awaitable<WebReply> reply_to(const AskForReply& ask) {
    struct Later {
      explicit Later(asio::io_context& io) : ready(io, asio::steady_timer::time_point::max()) {}
      asio::steady_timer ready;
      std::optional<WebReply> reply;
    };
    const auto later = std::make_shared<Later>(io_);
    ask([later](WebReply reply) {
      later->reply = std::move(reply);
      later->ready.cancel();
    });
    error_code ignored;
    while (!later->reply) co_await later->ready.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    co_return std::move(*later->reply);
  }

  static asio::awaitable<bool> write(Stream& stream, const http::request<http::empty_body>& request, WebReply reply) {
    error_code failure;
    stream.expires_after(kReplyTime);
    if (reply.pieces) co_return co_await write_pieces(stream, request, reply);
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

  /// False: the connection is to end.
  static asio::awaitable<bool> write_pieces(Stream& stream, const http::request<http::empty_body>& request,
                                            const WebReply& reply) {
    error_code failure;
    http::response<http::empty_body> head{static_cast<http::status>(reply.status), request.version()};
    add_headers(head, reply);
    head.keep_alive(request.keep_alive());
    head.content_length(reply.bytes);
    http::response_serializer<http::empty_body> serializer(head);
    co_await http::async_write_header(stream, serializer, asio::redirect_error(asio::use_awaitable, failure));
    for (std::uint64_t left = reply.bytes; !failure;) {
      const std::optional<std::string> piece = next_of(reply);
      if (!piece || piece->size() > left) co_return false;
      if (piece->empty()) co_return left == 0;
      left -= piece->size();
      stream.expires_after(kPieceTime);
      co_await asio::async_write(stream, asio::buffer(*piece), asio::redirect_error(asio::use_awaitable, failure));
    }
    co_return false;
  }

  static std::optional<std::string> next_of(const WebReply& reply) {
    try {
      return reply.pieces();
    } catch (const std::exception& e) {
      std::fprintf(stderr, "tankrig: a download broke off: %s\n", printable(e.what()).c_str());
      return std::nullopt;
    }
  }

  asio::awaitable<void> talk(Stream stream, http::request<http::empty_body> request,
                             std::shared_ptr<BrowserSession> session) {
    const auto client = std::make_shared<Client>(std::move(stream), std::move(session), io_);
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
      if (failure || client->session->over()) break;
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
  ConnectionHandlers handlers_;
  std::optional<asio::ssl::context> tls_;
  std::map<std::string, std::size_t> connections_of_;
  std::map<ClientId, std::shared_ptr<Client>> clients_;
  ClientId last_id_ = 0;
  std::size_t connections_ = 0;
};

Connections::Connections(asio::io_context& io, const ListenOptions& options, ConnectionHandlers handlers)
    : implementation_(std::make_unique<Implementation>(io, options, std::move(handlers))) {}
Connections::~Connections() = default;
std::uint16_t Connections::port() const { return implementation_->port(); }
const BrowserSession& Connections::session(ClientId client) const { return implementation_->session(client); }
void Connections::end_talks() { implementation_->end_talks(); }
void Connections::send(ClientId client, const Message& message, bool binary, const std::string& newest) {
  implementation_->send(client, message, binary, newest);
}
void Connections::send_to_all(const Message& message, bool binary, const std::string& newest) {
  implementation_->send_to_all(message, binary, newest);
}

}  // namespace tankrig
