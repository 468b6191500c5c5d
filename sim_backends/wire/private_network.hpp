// A network for this process alone: emulated cameras on loopback addresses that nobody else sees.
#pragma once

#include "core/result.hpp"

namespace tankrig::sim {

/// Moves the process into a new network namespace. Its loopback is up and has the addresses 127.0.0.1 ..
/// 127.0.0.`addresses`, each by itself, so that a search for GigE Vision cameras visits it. Users other than root also
/// get a user namespace, with the same user and group ids. Programs started later share the network.
/// Threads: call before the first thread starts.
/// Errors: kRefused, with the reason; then the process is unchanged.
Status enter_private_network(int addresses = 4);

}  // namespace tankrig::sim
