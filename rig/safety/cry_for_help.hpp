// Tells people at the tank what to cut, until it is over.
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "core/reminder.hpp"

namespace tankrig {

/// Tells at once, then every kAgain, and once more at the end: confirmed, or the object ends.
/// Threads: one. `tell` is called in that and in one of its own, never in two at once.
class CryForHelp {
 public:
  static constexpr Duration kAgain = std::chrono::seconds{2};
  using Tell = std::function<void(const std::string&)>;

  explicit CryForHelp(Tell tell, Duration again = kAgain) : tell_(std::move(tell)), again_(again) {}
  ~CryForHelp();
  CryForHelp(const CryForHelp&) = delete;
  CryForHelp& operator=(const CryForHelp&) = delete;

  /// `what`: the EndState in the words of to_cut(); empty: laser off and arm at rest are confirmed.
  void cut(const std::string& what);

 private:
  void say(const std::string& line);

  const Tell tell_;
  const Duration again_;
  std::mutex mutex_;  // of tell_
  std::string what_;
  std::optional<Reminder> reminder_;
};

}  // namespace tankrig
