#include "rig/safety/cry_for_help.hpp"

#include <system_error>

namespace tankrig {

CryForHelp::~CryForHelp() {
  reminder_.reset();
  if (what_.empty()) return;
  say("the program ends, and it is not confirmed: " + what_);
}

void CryForHelp::cut(const std::string& what) {
  if (what == what_) return;
  reminder_.reset();
  what_ = what;
  if (what.empty()) return say("confirmed now: laser off, arm at rest");
  say(what);
  try {
    reminder_.emplace(again_, again_, [this, what] { say("still: " + what); });
  } catch (const std::system_error&) {  // no thread to be had: it was said, and will be at the end
  }
}

void CryForHelp::say(const std::string& line) {
  const std::lock_guard lock(mutex_);
  tell_(line);
}

}  // namespace tankrig
