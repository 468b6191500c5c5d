#include "apps/tankrig/serve/listen_options.hpp"

#include <arpa/inet.h>

#include <charconv>
#include <system_error>

#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace tankrig::app {
namespace {

bool is_address(const std::string& text) {
  in6_addr bytes{};
  return ::inet_pton(AF_INET, text.c_str(), &bytes) == 1 || ::inet_pton(AF_INET6, text.c_str(), &bytes) == 1;
}

bool is_number(const char* begin, const char* end, std::uint16_t& number) {
  const auto [rest, failure] = std::from_chars(begin, end, number);
  return rest == end && failure == std::errc{};
}

/// "192.168.1.5:8080" or "[fe80::1]:8080".
void read_endpoint(const std::string& text, ListenOptions& into) {
  const std::size_t colon = text.rfind(':');
  std::string address = text.substr(0, colon);
  if (address.starts_with('[') && address.ends_with(']'))
    address = address.substr(1, address.size() - 2);
  else if (address.find(':') != std::string::npos)
    address.clear();
  const char* end = text.data() + text.size();
  const char* port = colon == std::string::npos ? end : text.data() + colon + 1;
  if (!is_address(address) || port == end || !is_number(port, end, into.port))
    throw InputError("--listen: found '" + shown_text(text) +
                     "', expected ADDRESS:PORT, as 192.168.1.5:8080 or [::1]:8080");
  into.address = address;
}

}  // namespace

ListenOptions listen_options(const ListenCommand& options) {
  ListenOptions made{.port = options.port,
                     .names = options.names,
                     .users = options.users,
                     .tls_certificate = options.tls_certificate,
                     .tls_key = options.tls_key};
  if (!options.listen.empty()) read_endpoint(options.listen, made);
  if (is_loopback(made.address)) return made;
  if (made.users.empty())
    throw InputError("--listen: found " + made.address + ", which others can reach, expected --users FILE with it");
  if (made.tls_certificate.empty() && !options.without_tls)
    throw InputError("--listen: found " + made.address +
                     ", which others can reach, expected --tls-cert and --tls-key with it, or --without-tls");
  return made;
}

void add_listen_options(CLI::App& serve, ListenCommand& o) {
  auto* port = serve.add_option("--port", o.port, "Port on 127.0.0.1; 0: any that is free")->capture_default_str();
  serve.add_option("--listen", o.listen, "ADDRESS:PORT; beyond this machine with --users and TLS")->excludes(port);
  serve.add_option("--name", o.names, "A name of this machine under which browsers ask; several are");
  serve.add_option("--users", o.users,
                   "File of users who log in (tankrig serve user add); without, a printed key lets in");
  auto* certificate = serve.add_option("--tls-cert", o.tls_certificate, "Certificate and its chain, PEM");
  auto* key = serve.add_option("--tls-key", o.tls_key, "Its key, PEM")->needs(certificate);
  certificate->needs(key);
  serve.add_flag("--without-tls", o.without_tls, "Passwords and all else go over the network for everyone to read")
      ->excludes(certificate);
}

}  // namespace tankrig::app
