#include "rig/guardian/guardian_step.hpp"

#include <algorithm>

namespace tankrig {

GuardianStep step(const GuardianState& state, const GuardianInputs& in) noexcept {
  GuardianStep next{state, GuardianAct::kWatch};
  GuardianState& s = next.state;
  const bool stands = in.watched && state.watched && in.steps == state.steps;
  s.stalled = stands ? state.stalled + std::min(in.now - state.looked, kLongestLook) : Duration{0};
  s.watched = in.watched;
  s.steps = in.steps;
  s.looked = in.now;
  s.taken_over = state.taken_over || (in.watched && (in.gone || s.stalled > in.patience));
  const bool settled = state.taken_over && (in.confirmed || in.acknowledged);
  if (in.gone && (settled || !s.taken_over))
    next.act = GuardianAct::kEnd;
  else if (s.taken_over)
    next.act = GuardianAct::kMakeSafe;
  return next;
}

}  // namespace tankrig
