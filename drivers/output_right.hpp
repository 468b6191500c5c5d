// The right to move an arm and to light a laser: who is not a friend here cannot have one.
#pragma once

namespace tankrig {

class Arm;
class GuardedOutputs;
struct BenchRight;

/// Every call that moves or lights takes one. rig/safety's guard makes its own, behind its safety step; an arm makes one
/// for rest alone. BenchRight is the tests': it drives a device without a rig.
/// RT: safe.
class OutputRight {
 public:
  OutputRight(const OutputRight&) = delete;
  OutputRight& operator=(const OutputRight&) = delete;

 private:
  friend Arm;
  friend GuardedOutputs;
  friend BenchRight;
  explicit constexpr OutputRight() noexcept {}  // not defaulted: that would be no constructor at all to `{}`
};

}  // namespace tankrig
