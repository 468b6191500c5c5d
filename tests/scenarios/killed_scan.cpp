#include "tests/scenarios/killed_scan.hpp"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "rig/guardian/guardian.hpp"
#include "tests/scenarios/page.hpp"
#include "tests/scenarios/verdict.hpp"
#include "tests/scenarios/wire_rig.hpp"
#include "tests/support/control_group.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::scenarios {

using namespace std::chrono_literals;

namespace {

constexpr Duration kPulled = 5s;
constexpr Duration kNobody = 3s;                           // so long nobody is seen to act
constexpr Duration kEnds = 20s;                            // a scan that is stopped closes its session
constexpr Duration kGuarded = 95ms, kGuardedRest = 145ms;  // 100 and 150 ms after the last step, less a cycle
constexpr Duration kMissing = 1100ms;  // a guardian counts as missing after a second; a cycle, and the lines
constexpr Duration kPluggedIn = 300ms;

class Scene {
 public:
  Scene(const std::string& carrier, Ending ending) : carrier_(carrier), rig_(folder_.path(), {}) {
    k_.ending = ending;
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  }

  Killed run() {
    const testing_support::MachineWitness witness;
    if (begin()) end();
    k_.machine_late = witness.latest();
    return k_;
  }

 private:
  template <class IsSo>
  bool until(Duration longest, IsSo is_so) {
    for (const Stamp deadline = clock_.now() + longest; clock_.now() < deadline; clock_.sleep_until(clock_.now() + 1ms))
      if (is_so()) return true;
    return is_so();
  }
  double speed() { return rig_.arm().true_velocity_at(clock_.now()).cwiseAbs().maxCoeff(); }
  bool sweeps() { return rig_.relay().relay_closed() && speed() > 0.05; }
  bool safe() { return !rig_.relay().relay_closed() && speed() < 1e-3; }
  bool cut() { return !rig_.box().closed(); }

  bool begin() {
    std::fflush(stdout);
    scan_ = ::fork();
    if (scan_ == 0) {
      ::execl("/proc/self/exe", "reliability", "--scan", folder_.path().c_str(), carrier_.c_str(), nullptr);
      ::_exit(127);
    }
    if (scan_ < 0) return false;
    if (until(60s, [&] { return rig_.relay().first_on().has_value(); }) && until(5s, [&] { return sweeps(); })) {
      clock_.sleep_until(clock_.now() + 300ms);  // well into the sweep, which takes seconds
      k_.in_sweep = sweeps();
    }
    std::ifstream(folder_.path() / "guardian.pid") >> guardian_;
    if (k_.in_sweep && guardian_ > 0) return true;
    for (const pid_t process : {scan_, guardian_})
      if (process > 0) ::kill(process, SIGKILL), ::waitpid(process, nullptr, 0);
    return false;
  }

  void end() {
    std::optional<testing_support::ControlGroup> group;
    if (k_.ending == Ending::kFrozen || k_.ending == Ending::kOutOfMemory) {
      group.emplace(scan_);
      if (!group->reachable()) {
        k_.skipped = "no control groups of version 2 that this user may make and freeze";
        ::kill(scan_, SIGKILL);
      }
    }
    if (k_.skipped.empty()) happen(group);
    for (const pid_t process : {scan_, guardian_}) ::waitpid(process, nullptr, 0);
  }

  void happen(std::optional<testing_support::ControlGroup>& group) {
    const bool pulled = k_.ending == Ending::kLinesPulled;
    if (pulled) rig_.pull_lines();
    k_.when = clock_.now();
    switch (k_.ending) {
      case Ending::kStopped:
        ::kill(scan_, SIGSTOP);
        break;
      case Ending::kFrozen:
        group->freeze(true);
        break;
      case Ending::kOutOfMemory:
        group->kill();
        break;
      case Ending::kGuardianKilled:
        ::kill(guardian_, SIGKILL);
        break;
      case Ending::kBothKilled:
        ::kill(guardian_, SIGKILL);
        ::kill(scan_, SIGKILL);
        break;
      case Ending::kKilled:
      case Ending::kLinesPulled:
        ::kill(scan_, SIGKILL);
        break;
    }
    if (pulled) {
      clock_.sleep_until(k_.when + kPulled);
      k_.when = clock_.now();
      rig_.plug_lines();
    }
    until(k_.ending == Ending::kBothKilled ? kNobody : kWatched, [&] { return safe(); });
    k_.off_byte = rig_.relay().off_since();
    k_.rest = rig_.arm().rest_since();
    if (k_.ending == Ending::kGuardianKilled) k_.ended = until(kEnds, [&] { return ended(); });
    until(kWatched, [&] { return cut(); });
    k_.last_edge = rig_.box().last_edge();  // one that wakes up gives more
    k_.cut = rig_.box().closed() ? std::nullopt : rig_.box().opened();
    wake_up(group);
  }

  /// One that stands still goes on, finds itself taken over, and ends.
  void wake_up(std::optional<testing_support::ControlGroup>& group) {
    if (k_.ending != Ending::kStopped && k_.ending != Ending::kFrozen) return;
    if (group) group->freeze(false);
    ::kill(scan_, SIGCONT);
    k_.ended = until(kEnds, [&] {
      k_.woke_up = k_.woke_up || !rig_.relay().off_since() || rig_.arm().rest_since() != k_.rest;
      return ended();
    });
    if (!k_.ended) ::kill(scan_, SIGKILL);
  }

  bool ended() {
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(scan_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == scan_;
  }

  const std::string carrier_;
  const TemporaryFolder folder_;
  MonotonicClock clock_;
  EmulatedRig rig_;
  pid_t scan_ = -1, guardian_ = -1;
  Killed k_;
};

}  // namespace

const char* to_string(Ending ending) {
  switch (ending) {
    case Ending::kKilled:
      return "killed (SIGKILL)";
    case Ending::kOutOfMemory:
      return "killed for want of memory";
    case Ending::kStopped:
      return "stopped (SIGSTOP)";
    case Ending::kFrozen:
      return "its control group frozen";
    case Ending::kGuardianKilled:
      return "its guardian killed";
    case Ending::kBothKilled:
      return "killed with its guardian";
    case Ending::kLinesPulled:
      return "killed with its lines pulled, which are back after 5 s";
  }
  return "?";
}

std::vector<Ending> endings() {
  return {Ending::kKilled,         Ending::kOutOfMemory, Ending::kStopped,    Ending::kFrozen,
          Ending::kGuardianKilled, Ending::kBothKilled,  Ending::kLinesPulled};
}

EndingBounds bounds(Ending ending) {
  if (ending == Ending::kBothKilled) return {};
  if (ending == Ending::kGuardianKilled) return {kMissing, kMissing};
  if (ending == Ending::kLinesPulled) return {kPluggedIn, kPluggedIn};
  return {kGuarded, kGuardedRest};
}

Killed end_scan(const std::string& carrier, Ending ending) { return Scene(carrier, ending).run(); }

bool too_late(const Killed& k) { return k.machine_late > kBearable; }

std::string broken(const Killed& k) {
  if (!k.skipped.empty()) return "";
  if (!k.in_sweep) return too_late(k) ? "" : "the sweep was not reached";
  if (k.woke_up) return "it lit or moved again when it woke up";
  if (!k.ended) return "it did not end";
  if (!k.cut || !k.last_edge) return "the watchdog box is closed";
  if (*k.cut - *k.last_edge > kBoxOpens && !too_late(k))
    return "contactors open " + after(k.cut, *k.last_edge) + " ms after the box's last edge";
  const EndingBounds bound = bounds(k.ending);
  if (!bound.off_byte) return k.off_byte || k.rest ? "somebody acted, and nobody knows who" : "";
  if (!k.off_byte || (*k.off_byte - k.when > *bound.off_byte && !too_late(k)))
    return "off byte " + after(k.off_byte, k.when) + " ms";
  if (!k.rest || (*k.rest - k.when > *bound.rest && !too_late(k))) return "rest " + after(k.rest, k.when) + " ms";
  return "";
}

int run_scan_guardian(char** argv) {
  return run_guardian(guardian_settings(argv[2], argv[3]), OwnedDescriptor(std::atoi(argv[5])),
                      OwnedDescriptor(std::atoi(argv[7])));
}

}  // namespace tankrig::scenarios
