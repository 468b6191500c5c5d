// A tankrig command on a terminal of its own: the server is to it what a person at a keyboard is.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>
#include <vector>

namespace tankrig {

/// The program's terminal ends with this object or with this process, however that ends; a command that moves or lights
/// anything takes the loss of its terminal for a stop.
/// Threads: one, the only one of its process when the program is started.
class TerminalProgram {
 public:
  /// `command`: the program's path, then its arguments.
  /// Errors: InputError if no terminal or process can be had.
  explicit TerminalProgram(const std::vector<std::string>& command);
  ~TerminalProgram();
  TerminalProgram(const TerminalProgram&) = delete;
  TerminalProgram& operator=(const TerminalProgram&) = delete;

  // Descriptors to wait for, never to close: what it prints, what it feeds (console/feed/feed_format.hpp), and whether
  // it has ended.
  int terminal() const { return terminal_; }
  int feed() const { return feed_; }
  int end() const { return end_; }

  /// As if typed. What the terminal has no room for is lost.
  void type(std::string_view keys) noexcept;
  /// Ctrl-C. Pressed again within a second it is the same one.
  void interrupt() noexcept { type("\x03"); }

  /// After end() became readable: its exit code, or 128 and the number of the signal that ended it.
  int exit_code();

 private:
  int terminal_ = -1, feed_ = -1, end_ = -1;
  pid_t process_ = -1;
};

}  // namespace tankrig
