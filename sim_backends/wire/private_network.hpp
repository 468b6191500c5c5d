// A network of this process's own: emulated cameras on loopback addresses that nobody else sees.
#pragma once

#include "core/result.hpp"

namespace tankrig::sim {

/// Moves the process into a new network namespace whose loopback is up and has the addresses 127.0.0.1 ..
/// 127.0.0.`addresses`, each as an address of its own, so that a search for GigE Vision cameras visits it. As root that
/// is all; others get a user namespace around it, in which their user and group ids stay the same. Programs started
/// later live in the same network.
/// Threads: before the first thread is started.
/// Errors: kRefused, with what forbids it; then the process is as it was.
Status enter_private_network(int addresses = 4);

}  // namespace tankrig::sim
