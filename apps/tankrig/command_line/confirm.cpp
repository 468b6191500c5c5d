#include "apps/tankrig/command_line/confirm.hpp"

#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "apps/tankrig/command_line/stop.hpp"
#include "core/input_error.hpp"

namespace tankrig::app {

std::optional<std::string> typed_line() {
  constexpr int kLook_ms = 50;  // a signal just before the wait does not end it
  pollfd terminal{STDIN_FILENO, POLLIN, 0};
  while (!StopOnSignal::requested() && ::poll(&terminal, 1, kLook_ms) <= 0) {
  }
  std::string line;
  if (StopOnSignal::requested() || !std::getline(std::cin, line)) return std::nullopt;
  return line;
}

void confirm(const std::string& question, bool yes) {
  if (yes) return;
  if (isatty(STDIN_FILENO) == 0)
    throw InputError("not confirmed: standard input is no terminal, expected --yes (" + question + ")");
  std::fprintf(stderr, "%s [y/N] ", question.c_str());
  const std::string answer = typed_line().value_or("");
  if (answer != "y" && answer != "Y" && answer != "yes") throw InputError("not confirmed: nothing was done");
}

}  // namespace tankrig::app
