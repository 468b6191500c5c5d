// One finding about the machine: a verdict, the measured number, and the cure.
#pragma once

#include <cstdint>
#include <string>

namespace tankrig {

enum class Verdict : std::uint8_t {
  kGood,
  kUsable,  ///< works, with less margin than it could have
  kBad,
  kAbsent,  ///< not there
};

inline const char* to_string(Verdict verdict) noexcept {
  constexpr const char* kWords[] = {"good", "usable", "bad", "not there"};
  return kWords[static_cast<int>(verdict)];
}

struct Finding {
  std::string what;  ///< "kernel", "camera left", ...
  Verdict verdict = Verdict::kGood;
  std::string measured;
  std::string cure{};    ///< one line; empty if there is nothing to do
  bool refused = false;  ///< a scan of this rig would refuse to start
};

}  // namespace tankrig
