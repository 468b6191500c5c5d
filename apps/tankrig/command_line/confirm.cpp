#include "apps/tankrig/command_line/confirm.hpp"

#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "core/input_error.hpp"

namespace tankrig::app {

void confirm(const std::string& question, bool yes) {
  if (yes) return;
  if (isatty(STDIN_FILENO) == 0)
    throw InputError("not confirmed: standard input is no terminal, expected --yes (" + question + ")");
  std::fprintf(stderr, "%s [y/N] ", question.c_str());
  std::string answer;
  std::getline(std::cin, answer);
  if (answer != "y" && answer != "Y" && answer != "yes") throw InputError("not confirmed: nothing was done");
}

}  // namespace tankrig::app
