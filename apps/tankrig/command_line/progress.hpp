// Progress of long work on standard error: one line that moves on a terminal, a line per stage elsewhere. Whoever
// listens to the feed is told as well.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

#include "pipeline/reconstruct_session.hpp"
#include "rig/safety/cry_for_help.hpp"

namespace tankrig::app {

/// Threads: any.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `fraction` of `stage` is done, in [0, 1]. `detail`: what has come of it so far; elsewhere than on a terminal the
  /// last one is told at the stage's end.
  void update(const std::string& stage, double fraction, const std::string& detail = {});
  /// update(), for as long as this lives.
  ProgressCallback callback() {
    return [this](const std::string& stage, double fraction) { update(stage, fraction); };
  }
  /// Lines of their own.
  void note(const std::string& text);
  void warn(const std::string& text);
  /// A warning that comes again and again, until `what` is empty or the program ends.
  /// Threads: one.
  void cut(const std::string& what) { cry_.cut(what); }
  /// Ends the moving line: something else is about to be printed.
  void finish_line();

 private:
  void end_line();
  void end_stage();

  std::mutex mutex_;  // guards what follows, up to fed_
  bool terminal_;
  bool line_open_ = false;
  std::string stage_, detail_;
  std::chrono::steady_clock::time_point last_{}, fed_{};
  CryForHelp cry_{[this](const std::string& line) { warn(line); }};  // last: it may warn at its end
};

}  // namespace tankrig::app
