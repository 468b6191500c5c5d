// What the processor has to do besides keeping time, and the peer under it.
#pragma once

#include <cstdint>

#include "core/time.hpp"
#include "tests/kernel/guest.hpp"

namespace tankrig::test {

/// Processor, memory and network, more than there is, until the end of the scope. Giving much memory back and taking in
/// much from the network are what the standard kernel does for milliseconds without letting anybody else run.
class Load {
 public:
  Load();
  ~Load();

 private:
  Background stress_;
};

/// Time the processor has had nothing to do since the guest began [s].
double processor_idle();

/// The worst wake-up latency of cyclictest at `priority`, a thousand times a second, under such a Load.
/// Errors: std::runtime_error.
Duration loaded_cyclictest(int priority, std::uint64_t cycles);

}  // namespace tankrig::test
