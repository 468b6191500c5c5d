// What a command waits for, said where it takes long.
#pragma once

#include <cstdio>
#include <string>
#include <utility>

#include "core/reminder.hpp"

namespace tankrig::app {

/// While it lives, says on standard error what is waited for: after kFirst, then every kAgain.
class Waiting {
 public:
  static constexpr Duration kFirst = std::chrono::seconds{2}, kAgain = std::chrono::seconds{10};

  explicit Waiting(std::string what)
      : reminder_(kFirst, kAgain,
                  [what = std::move(what)] { std::fprintf(stderr, "tankrig: waiting for %s\n", what.c_str()); }) {}

 private:
  Reminder reminder_;
};

}  // namespace tankrig::app
