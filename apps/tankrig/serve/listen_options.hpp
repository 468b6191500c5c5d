// Where `tankrig serve` listens and for whom, on the command line; and who its users are.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/command_line/command_line.hpp"
#include "console/server/access.hpp"

namespace tankrig::app {

struct ListenCommand {
  std::uint16_t port = 8080;
  std::string listen;
  std::vector<std::string> names;
  std::string users, tls_certificate, tls_key;
  bool without_tls = false;
};

void add_listen_options(CLI::App& serve, ListenCommand& options);

/// Errors: InputError if an address beyond this machine is to be listened on without users, or without TLS or its waiver.
ListenOptions listen_options(const ListenCommand& options);

/// `tankrig serve user`.
void add_user(CLI::App& serve, ChosenCommand& chosen);

}  // namespace tankrig::app
