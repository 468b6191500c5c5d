#include "console/server/web_server.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "console/server/password_check.hpp"
#include "console/server/site.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

using Method = WebRequest::Method;

constexpr std::size_t kMostLoginBytes = 4 << 10;
constexpr double kMostRequests = 500, kRequestsPerSecond = 200;  // of one address
constexpr int kMostPasswordChecks = 2;                           // at a time

constexpr char kLoginPolicy[] =
    "default-src 'none'; style-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

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

/// `says`: of ours, without markup.
WebReply login_page(unsigned status, const std::string& says) {
  std::string page(site_file("/login")->text);
  const std::string place = "<!--says-->";
  page.replace(page.find(place), place.size(), says);
  return {.status = status, .type = "text/html; charset=utf-8", .body = std::move(page), .policy = kLoginPolicy};
}

WebReply said(unsigned status, const std::string& what) { return {.status = status, .body = what + "\n"}; }

WebReply too_little(std::string_view act) {
  return said(403, "Refused: this needs the role " + std::string(name_of(least_role(act))) + ".");
}

}  // namespace

WebServer::WebServer(boost::asio::io_context& io, const ListenOptions& options, WebHandlers handlers)
    : io_(io),
      users_(options.users),
      handlers_(std::move(handlers)),
      connections_(io, options,
                   {[this](const WebRequest& request) { return answer(request); }, handlers_.joined, handlers_.left,
                    handlers_.said}),
      access_(options, connections_.port()),
      requests_(kMostRequests, kRequestsPerSecond) {
  if (access_.has_users() && read_users(users_).empty())
    throw InputError(users_, "found no user, expected one: tankrig serve user add NAME --role ROLE");
}

WebAnswer WebServer::answer(const WebRequest& request) {
  if (!requests_.take(std::string(request.address), BrowserSession::Clock::now()))
    return said(429, "Too many requests from this address; try again in a second.");
  const RequestHeaders& headers = request.headers;
  const std::string refused = access_.refused(headers);
  const auto session = access_.session(headers);
  const auto path = decoded(request.target.substr(0, request.target.find('?')));
  if (headers.upgrade && refused.empty() && session && path == "/live" && may(session->role(), get_act(*path)))
    return WebTalk{session};
  if (!refused.empty()) return said(403, "Refused: " + refused + ".");
  if (const std::string_view key = "/?key=";
      request.target.starts_with(key) && access_.opens(request.target.substr(key.size())))
    return WebReply{.status = 303, .location = "/", .cookie = access_.let_in()};
  if (!path) return said(400, "The address is no proper one.");
  if (access_.has_users())
    if (auto answer = answer_of_login(request, *path, session)) return *std::move(answer);
  if (!session) return said(403, "Refused: without this console's key: open the address that `tankrig serve` printed.");
  if (request.method == Method::kPost && handlers_.upload)
    return may(session->role(), "upload") ? WebAnswer(upload(request, *path, *session)) : too_little("upload");
  if (request.method != Method::kGet) return said(405, "Only GET is served.");
  if (const std::string act = get_act(*path); !may(session->role(), act)) return too_little(act);
  return get(*path);
}

std::optional<WebAnswer> WebServer::answer_of_login(const WebRequest& request, const std::string& path,
                                                    const std::shared_ptr<BrowserSession>& session) {
  const bool program = !request.headers.authorization.empty();
  if (request.method == Method::kPost) {
    if (request.headers.origin.empty() && !program) return said(403, "Refused: a form without a page.");
    if (path == "/login") return log_in(std::string(request.address));
    if (path == "/logout") return log_out(session);
  }
  if (path == "/login") return login_page(200, "");
  if (path == "/console.css") return get(path);
  if (session) return std::nullopt;
  if (program) return said(401, "Refused: nobody has this token, or it was revoked.");
  if (path == "/") return WebReply{.status = 303, .location = "/login"};
  return said(401, "Refused: log in first, at /login.");
}

AskForReply WebServer::get(const std::string& path) {
  return [this, path](SendReply reply) { handlers_.get(path, std::move(reply)); };
}

WebUploadPlan WebServer::upload(const WebRequest& request, const std::string& path, const BrowserSession& session) {
  return handlers_.upload(
      {path, fields_of(query_of(request.target)), session.name(), std::string(request.address), request.bytes});
}

WebAnswer WebServer::log_in(const std::string& address) {
  if (const auto left = delay_.left(address, BrowserSession::Clock::now()); left.count() > 0)
    return login_page(429, "Too many wrong passwords: wait for " + std::to_string(left.count()) + " s.");
  return WebForm{kMostLoginBytes, [this, address](const std::optional<std::string>& form, SendReply reply) {
                   if (!form) return reply(login_page(400, "The form did not arrive."));
                   auto fields = fields_of(*form);
                   check(fields["name"], fields["password"], address, std::move(reply));
                 }};
}

void WebServer::check(const std::string& name, const std::string& password, const std::string& address,
                      SendReply reply) {
  std::vector<User> users;
  try {
    users = read_users(users_);
  } catch (const InputError& e) {
    std::fprintf(stderr, "tankrig: %s\n", printable(e.what()).c_str());
    return reply(login_page(500, "The users' file cannot be read: see the terminal of the server."));
  }
  if (checks_ >= kMostPasswordChecks) return reply(login_page(503, "Others are logging in: try again."));
  std::optional<User> user;
  if (const auto found = std::ranges::find(users, name, &User::name); found != users.end()) user = *found;
  ++checks_;
  check_password(io_, user ? user->password : nobodys_hash(), password, [=, this](bool right) {
    --checks_;
    if (!user || !right) {
      delay_.failed(address, BrowserSession::Clock::now());
      std::fprintf(stderr, "tankrig: refused a login as '%s'\n", shown_text(name).c_str());
      return reply(login_page(401, "Wrong name or password."));
    }
    delay_.succeeded(address);
    reply({.status = 303, .location = "/", .cookie = access_.let_in(user->name, user->role)});
  });
}

WebReply WebServer::log_out(const std::shared_ptr<BrowserSession>& session) {
  if (session) session->end();
  connections_.end_talks();
  return {.status = 303, .location = "/login"};
}

}  // namespace tankrig
