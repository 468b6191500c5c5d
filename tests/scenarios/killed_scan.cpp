#include "tests/scenarios/killed_scan.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

#include "tests/scenarios/page.hpp"
#include "tests/scenarios/verdict.hpp"
#include "tests/scenarios/wire_rig.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::scenarios {

using namespace std::chrono_literals;

Killed kill_scan(const std::string& carrier) {
  const TemporaryFolder folder;
  const testing_support::MachineWitness witness;
  EmulatedRig rig(folder.path(), {});
  MonotonicClock clock;
  const std::string runtime = folder.path().string();
  std::fflush(stdout);
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl("/proc/self/exe", "reliability", "--scan", runtime.c_str(), carrier.c_str(), nullptr);
    ::_exit(127);
  }
  if (child < 0) return {};
  const auto wait_for = [&](Duration longest, auto condition) {
    for (const Stamp deadline = clock.now() + longest; clock.now() < deadline && !condition();)
      clock.sleep_until(clock.now() + 1ms);
    return condition();
  };
  const auto speed = [&] { return rig.arm().true_velocity_at(clock.now()).cwiseAbs().maxCoeff(); };
  const auto sweeps = [&] { return rig.relay().relay_closed() && speed() > 0.05; };
  Killed k;
  if (wait_for(30s, [&] { return rig.relay().first_on().has_value(); }) && wait_for(5s, sweeps)) {
    clock.sleep_until(clock.now() + 300ms);  // well into the sweep, which takes seconds
    k.in_sweep = sweeps();
  }
  k.when = clock.now();
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  if (k.in_sweep)
    wait_for(kWatched, [&] {
      if (!k.rested && speed() < 1e-3) k.rested = clock.now();
      if (!k.opened && !rig.relay().relay_closed()) k.opened = rig.relay().opened();
      return k.rested && k.opened;
    });
  k.machine_late = witness.latest();
  return k;
}

bool too_late(const Killed& k) { return k.machine_late > kBearable; }

std::string broken(const Killed& k) {
  if (!k.in_sweep) return too_late(k) ? "" : "the sweep was not reached";
  if (!k.opened || (*k.opened - k.when > kRelayAlone && !too_late(k)))
    return "relay open " + after(k.opened, k.when) + " ms";
  if (!k.rested || (*k.rested - k.when > kArmAlone && !too_late(k)))
    return "arm at rest " + after(k.rested, k.when) + " ms";
  return "";
}

}  // namespace tankrig::scenarios
