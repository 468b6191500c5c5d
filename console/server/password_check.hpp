// A password is tried beside the server, which goes on serving.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <string>

#include "console/server/users.hpp"

namespace tankrig {

/// Calls `done` once, with whether it matches; false if this cannot be found out.
/// Threads: one. A child of the process does the work, so no other thread may use OpenSSL.
void check_password(boost::asio::io_context& io, const PasswordHash& hash, const std::string& password,
                    std::function<void(bool)> done);

}  // namespace tankrig
