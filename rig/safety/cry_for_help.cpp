#include "rig/safety/cry_for_help.hpp"

namespace tankrig {

CryForHelp::~CryForHelp() {
  if (!reminder_) return;
  reminder_.reset();
  say("the program ends, and it is not confirmed: " + what_);
}

void CryForHelp::cut(const std::string& what) {
  if (what == what_) return;
  reminder_.reset();
  what_ = what;
  if (what.empty()) return say("confirmed now: laser off, arm at rest");
  say(what);
  reminder_.emplace(again_, again_, [this, what] { say("still: " + what); });
}

void CryForHelp::say(const std::string& line) {
  const std::lock_guard lock(mutex_);
  tell_(line);
}

}  // namespace tankrig
