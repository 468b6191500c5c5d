// A tankrig command that answers a question: what it prints, when it has ended.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <string>
#include <vector>

namespace tankrig {

struct Captured {
  int exit_code = 0;
  std::string out, err;
};

/// Of what a program said, for people: why it failed.
std::string last_line(std::string text);

/// Runs `command` with nothing to read and calls `done` once. One that takes longer than `longest` or prints more than
/// 64 MB is asked to end (SIGTERM).
/// Errors: InputError if it cannot be started; then `done` is not called.
void capture(boost::asio::io_context& io, const std::vector<std::string>& command, std::function<void(Captured)> done,
             std::chrono::seconds longest = std::chrono::minutes{1});

}  // namespace tankrig
