#include "console/server/web_server.hpp"

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
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "console/server/password_check.hpp"
#include "console/server/rate_limits.hpp"
#include "console/server/site.hpp"
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
constexpr std::size_t kMostLoginBytes = 4 << 10;
constexpr double kMostRequests = 500, kRequestsPerSecond = 200;  // of one address
constexpr int kMostPasswordChecks = 2;                           // at a time
constexpr std::chrono::seconds kHandshakeTime = 5s, kRequestTime = 30s, kReplyTime = 10min;
constexpr std::chrono::seconds kUploadTime = 15min, kUploadSilence = 20s;
constexpr std::size_t kPiece = 64 << 10, kDroppedBytes = 4 << 20;  // the latter are read so that a refusal is heard
constexpr auto kSilence = 1500ms;  // of a WebSocket; it is pinged when half of it is over

constexpr char kPolicy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

constexpr char kLoginPolicy[] =
    "default-src 'none'; style-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

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

/// Of a form's "a=1&b=two", decoded; what is no proper percent-encoding is left out.
std::map<std::string, std::string> fields_of(std::string_view form) {
  std::map<std::string, std::string> fields;
  while (!form.empty()) {
    const std::string_view one = form.substr(0, form.find('&'));
    form.remove_prefix(std::min(one.size() + 1, form.size()));
    const std::size_t equals = one.find('=');
    if (equals == std::string_view::npos) continue;
    std::string given(one.substr(equals + 1));
    std::ranges::replace(given, '+', ' ');
    const auto name = decoded(one.substr(0, equals)), value = decoded(given);
    if (name && value) fields[*name] = *value;
  }
  return fields;
}

/// What follows the question mark.
std::string_view query_of(std::string_view target) {
  return target.substr(std::min(target.find('?'), target.size() - 1) + 1);
}

/// Whose requests are counted together: one address, or a network of IPv6 that one machine may use all of.
std::string counted_address(const asio::ip::address& address) {
  if (!address.is_v6()) return address.to_string();
  const auto bytes = address.to_v6().to_bytes();
  return {bytes.begin(), bytes.begin() + 8};
}

/// `says`: of ours, without markup.
WebReply login_page(unsigned status, const std::string& says) {
  std::string page(site_file("/login")->text);
  const std::string place = "<!--says-->";
  page.replace(page.find(place), place.size(), says);
  return {.status = status, .type = "text/html; charset=utf-8", .body = std::move(page), .policy = kLoginPolicy};
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

class WebServer::Implementation {
 public:
  Implementation(asio::io_context& io, const ListenOptions& options, WebHandlers handlers)
      : io_(io), options_(options), listener_(io), handlers_(std::move(handlers)), access_(options, listen()) {
    if (!options.tls_certificate.empty()) tls_ = tls_context(options);
    if (access_.has_users() && read_users(options.users).empty())
      throw InputError(options.users, "found no user, expected one: tankrig serve user add NAME --role ROLE");
    asio::co_spawn(io_, accept(), asio::detached);
  }

  std::string address() const { return access_.address(); }
  const BrowserSession& session(ClientId id) const { return *clients_.at(id)->session; }

  void send(ClientId id, const Message& message, bool binary, const std::string& newest) {
    if (const auto client = clients_.find(id); client != clients_.end()) put(*client->second, message, binary, newest);
  }
  void send_to_all(const Message& message, bool binary, const std::string& newest) {
    for (const auto& [id, client] : clients_) put(*client, message, binary, newest);
  }

 private:
  std::uint16_t listen() {
    error_code failure;
    const asio::ip::address address = asio::ip::make_address(options_.address, failure);
    const tcp::endpoint here(address, options_.port);
    if (!failure) listener_.open(here.protocol(), failure);
    if (!failure) listener_.set_option(tcp::acceptor::reuse_address(true));
    if (!failure && address.is_v6()) listener_.set_option(asio::ip::v6_only(true));
    if (!failure) listener_.bind(here, failure);
    if (!failure) listener_.listen(asio::socket_base::max_listen_connections, failure);
    if (failure)
      throw InputError("--listen: found " + options_.address + ", port " + std::to_string(options_.port) + " (" +
                       failure.message() + "), expected an address of this machine and a port that is free");
    return listener_.local_endpoint().port();
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
      const bool upgrade = websocket::is_upgrade(request);
      const RequestHeaders headers{view(request[http::field::host]),          view(request[http::field::origin]),
                                   view(request[http::field::cookie]),        upgrade,
                                   view(request[http::field::authorization]), here};
      const std::string refused = access_.refused(headers);
      const auto session = access_.session(headers);
      const std::string_view target = view(request.target());
      const auto path = decoded(target.substr(0, target.find('?')));
      const bool busy = !requests_.take(address, BrowserSession::Clock::now());
      if (upgrade && !busy && refused.empty() && session && path == "/live" && may(session->role(), get_act(*path))) {
        stream.expires_never();
        co_await talk(std::move(stream), request, session);
        co_return;
      }
      open = request.keep_alive() && parser.is_done();
      request.keep_alive(open);
      WebReply reply;
      if (busy)
        reply = said(429, "Too many requests from this address; try again in a second.");
      else if (!refused.empty())
        reply = said(403, "Refused: " + refused + ".");
      else if (const std::string_view key = "/?key=";
               target.starts_with(key) && access_.opens(target.substr(key.size())))
        reply = {.status = 303, .location = "/", .cookie = access_.let_in()};
      else if (!path)
        reply = said(400, "The address is no proper one.");
      else if (const bool form = request.method() == http::verb::post && access_.has_users();
               form && headers.origin.empty() && headers.authorization.empty())
        reply = said(403, "Refused: a form without a page.");
      else if (form && path == "/login")
        reply = co_await log_in(stream, buffer, parser, address);
      else if (form && path == "/logout")
        reply = log_out(session);
      else if (access_.has_users() && path == "/login")
        reply = login_page(200, "");
      else if (access_.has_users() && path == "/console.css")
        reply = co_await answer(*path);
      else if (!session && access_.has_users())
        reply = path == "/" ? WebReply{.status = 303, .location = "/login"}
                            : said(401, "Refused: log in first, at /login.");
      else if (!session)
        reply = said(403, "Refused: without this console's key: open the address that `tankrig serve` printed.");
      else if (const bool upload = request.method() == http::verb::post && handlers_.upload;
               upload && !may(session->role(), "upload"))
        reply = too_little("upload");
      else if (upload)
        reply = co_await receive(stream, buffer, parser, *session, address);
      else if (request.method() != http::verb::get)
        reply = said(405, "Only GET is served.");
      else if (const std::string act = get_act(*path); !may(session->role(), act))
        reply = too_little(act);
      else
        reply = co_await answer(*path);
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

  /// A POST; the only one of its connection.
  asio::awaitable<WebReply> receive(Stream& stream, beast::flat_buffer& buffer,
                                    http::request_parser<http::empty_body>& header, const BrowserSession& session,
                                    const std::string& address) {
    const std::string_view target = view(header.get().target());
    WebUpload upload;
    upload.path = decoded(target.substr(0, target.find('?'))).value_or("");
    upload.query = fields_of(query_of(target));
    upload.user = session.name();
    upload.address = address;
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
  static asio::awaitable<WebReply> body_of(Stream& stream, beast::flat_buffer& buffer,
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
      stream.expires_after(
          std::min<std::chrono::steady_clock::duration>(end - std::chrono::steady_clock::now(), kUploadSilence));
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

  static WebReply too_little(std::string_view act) {
    return said(403, "Refused: this needs the role " + std::string(name_of(least_role(act))) + ".");
  }

  static WebReply said(unsigned status, const std::string& what) { return {.status = status, .body = what + "\n"}; }

  asio::awaitable<WebReply> log_in(Stream& stream, beast::flat_buffer& buffer,
                                   http::request_parser<http::empty_body>& header, const std::string& address) {
    if (const auto left = delay_.left(address, BrowserSession::Clock::now()); left.count() > 0)
      co_return login_page(429, "Too many wrong passwords: wait for " + std::to_string(left.count()) + " s.");
    error_code failure;
    http::request_parser<http::string_body> form(std::move(header));
    form.body_limit(kMostLoginBytes);
    co_await http::async_read(stream, buffer, form, asio::redirect_error(asio::use_awaitable, failure));
    if (failure) co_return login_page(400, "The form did not arrive.");
    auto fields = fields_of(form.get().body());
    const std::string name = fields["name"], password = fields["password"];
    std::vector<User> users;
    try {
      users = read_users(options_.users);
    } catch (const InputError& e) {
      std::fprintf(stderr, "tankrig: %s\n", printable(e.what()).c_str());
      co_return login_page(500, "The users' file cannot be read: see the terminal of the server.");
    }
    if (checks_ >= kMostPasswordChecks) co_return login_page(503, "Others are logging in: try again.");
    const auto user = std::ranges::find(users, name, &User::name);
    const bool right = co_await is_right(user == users.end() ? nobodys_hash() : user->password, password);
    if (user == users.end() || !right) {
      delay_.failed(address, BrowserSession::Clock::now());
      std::fprintf(stderr, "tankrig: refused a login as '%s'\n", shown_text(name).c_str());
      co_return login_page(401, "Wrong name or password.");
    }
    delay_.succeeded(address);
    co_return WebReply{.status = 303, .location = "/", .cookie = access_.let_in(user->name, user->role)};
  }

  asio::awaitable<bool> is_right(const PasswordHash& hash, const std::string& password) {
    struct Later {
      explicit Later(asio::io_context& io) : ready(io, asio::steady_timer::time_point::max()) {}
      asio::steady_timer ready;
      std::optional<bool> right;
    };
    const auto later = std::make_shared<Later>(io_);
    ++checks_;
    check_password(io_, hash, password, [later](bool right) {
      later->right = right;
      later->ready.cancel();
    });
    error_code ignored;
    while (!later->right) co_await later->ready.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    --checks_;
    co_return *later->right;
  }

  /// Its WebSockets end with it, and so does what moves or shines by its wish.
  WebReply log_out(const std::shared_ptr<BrowserSession>& session) {
    if (session) session->end();
    for (const auto& [id, client] : clients_)
      if (client->session->over()) let_go(*client);
    return {.status = 303, .location = "/login"};
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

  static asio::awaitable<bool> write(Stream& stream, const http::request<http::empty_body>& request, WebReply reply) {
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
  const ListenOptions options_;
  tcp::acceptor listener_;
  WebHandlers handlers_;
  Access access_;
  std::optional<asio::ssl::context> tls_;
  RequestLimit requests_{kMostRequests, kRequestsPerSecond};
  LoginDelay delay_;
  int checks_ = 0;  // of passwords, that run
  std::map<std::string, std::size_t> connections_of_;
  std::map<ClientId, std::shared_ptr<Client>> clients_;
  ClientId last_id_ = 0;
  std::size_t connections_ = 0;
};

WebServer::WebServer(asio::io_context& io, const ListenOptions& options, WebHandlers handlers)
    : implementation_(std::make_unique<Implementation>(io, options, std::move(handlers))) {}
WebServer::~WebServer() = default;
std::string WebServer::address() const { return implementation_->address(); }
const BrowserSession& WebServer::session(ClientId client) const { return implementation_->session(client); }
void WebServer::send(ClientId client, std::shared_ptr<const std::string> message, bool binary,
                     const std::string& newest) {
  implementation_->send(client, message, binary, newest);
}
void WebServer::send_to_all(std::shared_ptr<const std::string> message, bool binary, const std::string& newest) {
  implementation_->send_to_all(message, binary, newest);
}

}  // namespace tankrig
