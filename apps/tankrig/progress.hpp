// Progress of long work on standard error: one line that moves on a terminal, a line per stage elsewhere.
#pragma once

#include <chrono>
#include <string>

namespace tankrig::app {

/// Threads: one.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `fraction` of `stage` is done, in [0, 1].
  void update(const std::string& stage, double fraction);
  /// Lines of their own.
  void note(const std::string& text);
  void warn(const std::string& text);
  /// Ends the moving line: something else is about to be printed.
  void finish_line();

 private:
  bool terminal_;
  bool line_open_ = false;
  std::string stage_;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace tankrig::app
