// Every fault on every device, measured: writes docs/reliability.md, or with --quick checks one fault of every wire.
//
//   reliability [--quick | --mock] [--only DEVICE] [FILE.md]      --mock: the rows of the mock rig only
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "sim_backends/wire/private_network.hpp"
#include "tests/scenarios/wire_rig.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::scenarios {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using sim::FaultDevice;
using sim::FaultKind;

constexpr int kSkipped = 77;  // as CMakeLists.txt says

/// The fault as it is put to the test: in the sweep, with the laser on.
sim::FaultPlan usual(const sim::FaultOffer& offer, Duration at) {
  sim::FaultSpec s;
  s.device = offer.device;
  s.kind = offer.kind;
  s.origin = sim::FaultOrigin::kLaserOn;
  s.at = at;
  if (offer.device == FaultDevice::kCamera) s.camera = "mono";
  if (offer.kind == FaultKind::kSlow) s.ratio = 0.1;
  if (offer.device == FaultDevice::kArm && offer.kind == FaultKind::kDelayed) s.delay = 400ms;
  if (offer.device == FaultDevice::kCamera && offer.kind == FaultKind::kSlow) {
    s.delay = 400ms;
    s.duration = 100ms;
  }
  if (offer.device == FaultDevice::kCamera && offer.kind == FaultKind::kDelayed) s.delay = 30ms;
  if (offer.kind == FaultKind::kDropped) s.ratio = 0.05;
  const bool host = offer.device == FaultDevice::kDisk || offer.device == FaultDevice::kSupervisor;
  if (host && (offer.kind == FaultKind::kStuck || offer.kind == FaultKind::kSlow)) s.duration = 1s;
  return {{s}};
}

struct Row {
  std::string device, kind, where;
  Outcome outcome;
  std::optional<Stamp> off_byte, opened, rest;  // on the wire
  bool wire = false;
};

std::string ms(std::optional<Stamp> when, Stamp since) {
  if (!when || *when < since) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", 1e3 * seconds(*when - since));
  return text;
}

/// Frames that were taken and are not in the session, by reason.
std::string lost(const Outcome& o) {
  std::string text;
  for (const auto& [name, count] : o.counts) {
    const std::string reason = name.substr(name.find('.') + 1);
    if (count == 0 || name.starts_with("cycle.") || name.starts_with("sync.") || reason == "recorded" ||
        reason == "not_recorded")
      continue;
    text += (text.empty() ? "" : ", ") + name + " " + std::to_string(count);
  }
  return text.empty() ? "0" : text;
}

std::string cell(std::string text) {
  const fs::path temporary = fs::temp_directory_path();
  std::replace(text.begin(), text.end(), '|', '/');
  if (const auto at = text.find(temporary.string()); at != std::string::npos)
    text.erase(at, text.find(": ", at) + 2 - at);
  return text;
}

void write_row(std::ostream& out, const Row& row) {
  const Outcome& o = row.outcome;
  const std::string head = "| " + row.device + " | " + row.kind + " | " + row.where + " | ";
  if (!o.reaction) {
    out << head << "- | - | - | - | - | - | - | " << lost(o) << " | " << cell(o.status)
        << (o.has_begun ? "" : " (before the fault)") << "; " << to_string(o.left)
        << (o.lux.find(':') != std::string::npos ? "; " + cell(o.lux) : "") << " |\n";
    return;
  }
  const Reaction& r = *o.reaction;
  out << head << ms(r.detected, o.begun) << " | " << r.laser_cycles << " | " << ms(r.laser_off, r.detected) << " | "
      << (row.wire ? ms(row.off_byte, r.detected) + " | " + ms(row.opened, r.detected) : std::string("- | -")) << " | "
      << r.arm_cycles << " | " << (row.wire ? ms(row.rest, r.detected) : ms(r.arm_stop, r.detected)) << " | " << lost(o)
      << " | " << cell(o.status) << "; " << to_string(o.left) << " |\n";
}

/// What must hold of every one; empty if it does.
std::string broken(const Row& row) {
  const Outcome& o = row.outcome;
  if (!o.stopped()) return "";
  if (!o.has_begun) return "stopped before the fault: " + o.status;
  const bool silent = row.kind == "unplugged" || row.kind == "off" || row.kind == "slow";
  if (row.device == "camera" && silent && o.status.find("camera mono") == std::string::npos)
    return "the camera is not named: " + o.status;
  if (!o.reaction) return "laser and arm were not both commanded off: " + o.status;
  if (!o.reaction->laser_first) return "the arm was stopped before the laser was off";
  if (o.reaction->laser_cycles > 2) return "laser off " + std::to_string(o.reaction->laser_cycles) + " cycles late";
  if (o.reaction->arm_cycles > 1) return "arm stopped " + std::to_string(o.reaction->arm_cycles) + " cycles late";
  return "";
}

Row on_mock(const sim::FaultOffer& offer) {
  const TemporaryFolder folder;
  Row row{sim::to_string(offer.device), sim::to_string(offer.kind), "mock", {}, {}, {}, {}, false};
  row.outcome = scan_with_faults(usual(offer, 2s), folder.path() / "session");
  return row;
}

Row on_wire(const sim::FaultOffer& offer, const std::string& carrier) {
  const TemporaryFolder folder;
  EmulatedRig rig(folder.path(), usual(offer, 800ms));
  Row row{sim::to_string(offer.device), sim::to_string(offer.kind), carrier, {}, {}, {}, {}, true};
  try {
    row.outcome = scan_wire(folder.path(), carrier, folder.path() / "session", &rig);
  } catch (const std::exception& e) {
    row.outcome.status = std::string("not begun: ") + e.what();
  }
  row.off_byte = rig.relay().off_since();
  row.opened = rig.relay().opened();
  row.rest = rig.arm().rest_since();
  return row;
}

struct Killed {
  std::string carrier;
  std::optional<Stamp> opened, rested;
  Stamp when{};
};

/// Kills a scanning process in its sweep and watches what the devices do by themselves.
Killed kill_scan(const std::string& carrier) {
  const TemporaryFolder folder;
  EmulatedRig rig(folder.path(), {});
  MonotonicClock clock;
  const std::string runtime = folder.path().string();
  std::fflush(stdout);
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl("/proc/self/exe", "reliability", "--scan", runtime.c_str(), carrier.c_str(), nullptr);
    ::_exit(127);
  }
  const auto wait_for = [&](Duration longest, auto condition) {
    for (const Stamp deadline = clock.now() + longest; clock.now() < deadline && !condition();)
      clock.sleep_until(clock.now() + 1ms);
    return condition();
  };
  const auto moves = [&] { return rig.arm().true_velocity_at(clock.now()).cwiseAbs().maxCoeff() > 0.05; };
  wait_for(30s, [&] { return rig.relay().first_on().has_value(); });
  wait_for(5s, [&] { return moves(); });
  clock.sleep_until(clock.now() + 300ms);
  Killed k;
  k.carrier = carrier;
  k.when = clock.now();
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  if (rig.relay().relay_closed())
    wait_for(5s, [&] {
      if (!k.rested && rig.arm().true_velocity_at(clock.now()).cwiseAbs().maxCoeff() < 1e-3) k.rested = clock.now();
      if (!k.opened && !rig.relay().relay_closed()) k.opened = rig.relay().opened();
      return k.rested && k.opened;
    });
  return k;
}

/// On a busy machine a scan may end before it comes to its fault, e.g. for want of a camera's first frame: again,
/// twice.
template <class Measure, class Good>
auto in_time(Measure measure, Good good) {
  auto result = measure();
  for (int again = 0; again < 2 && !good(result); ++again) result = measure();
  return result;
}

bool on_carrier(const sim::FaultOffer& offer, const std::string& carrier) {
  const bool bus = offer.kind == FaultKind::kBusOff || offer.kind == FaultKind::kEnobufs;
  return carrier == "can" || (offer.device == FaultDevice::kArm && !bus);
}

bool is_quick(const sim::FaultOffer& offer, const std::string& carrier) {
  const auto is = [&](FaultDevice d, FaultKind k) { return offer.device == d && offer.kind == k; };
  if (carrier == "serial") return is(FaultDevice::kArm, FaultKind::kUnplugged);
  return is(FaultDevice::kArm, FaultKind::kBusOff) || is(FaultDevice::kLaser, FaultKind::kUnplugged) ||
         is(FaultDevice::kCamera, FaultKind::kUnplugged) || is(FaultDevice::kInterlock, FaultKind::kOff) ||
         is(FaultDevice::kLuxMeter, FaultKind::kOff);
}

constexpr char kHeading[] = R"(# What a fault does, measured
Made by `reliability docs/reliability.md` (cmake --build build --target reliability && build/tests/scenarios/reliability
docs/reliability.md; about ten minutes). Every fault that a device offers (docs/faults.md) begins in the sweep, with the
laser on. `mock`: the small rig of tests/scenarios in virtual time, cycle 200 Hz; the same figures on every machine.
`can`, `serial`: the real drivers on emulated wires in real time, one CLOCK_MONOTONIC for driver and emulator, on a
machine that did other work too.

| column | |
|---|---|
| detected | from the fault's begin until a call failed or the scan said so [ms] |
| off, cycles | steps of the executive from detection to the command that switches the laser off; at most 2 |
| off, command | the same in ms |
| off, byte | from detection until the relay had the byte that says off [ms]; "-": it did not get one |
| relay open | from detection until its contact opened [ms], by the byte or by its own watchdog (1 s) |
| stop, cycles | steps from the laser's command to the arm's; at most 1 |
| stop | from detection until the arm was commanded to rest (mock), or had the demand for rest on its wire [ms] |
| lost | frames that were taken and are not in the session, by reason |
| session, left | the session's status, and what the devices themselves confirmed at the end |

)";
constexpr char kTableHead[] =
    "| device | fault | on | detected | off, cycles | off, command | off, byte | relay open | stop, cycles | stop | "
    "lost | "
    "session, left |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";

struct Asked {
  bool quick = false, mock_only = false;
  std::string device;  ///< empty: all
  fs::path file;
};

int run(const Asked& asked) {
  const auto& [quick, mock_only, device, file] = asked;
  if (!mock_only)
    if (const Status entered = sim::enter_private_network(); !entered) {
      std::fprintf(stderr, "reliability: emulated cameras need a network of their own: %s\n", entered.error().where);
      return kSkipped;
    }
  std::ofstream out;
  if (!file.empty()) out.open(file);
  out << kHeading << kTableHead;
  int wrong = 0, scans = 0;
  const auto take = [&](const Row& row) {
    ++scans;
    write_row(out, row);
    out.flush();
    const std::string why = broken(row);
    std::printf("%s %s on %s: %s%s%s\n", row.device.c_str(), row.kind.c_str(), row.where.c_str(),
                row.outcome.status.c_str(), why.empty() ? "" : "; WRONG: ", why.c_str());
    std::fflush(stdout);
    wrong += !why.empty();
  };
  for (const sim::FaultOffer& offer : sim::fault_offers()) {
    if (!device.empty() && device != sim::to_string(offer.device)) continue;
    if (offer.mock && !quick) take(on_mock(offer));
    if (!offer.wire || mock_only) continue;
    for (const char* carrier : {"can", "serial"})
      if (on_carrier(offer, carrier) && (!quick || is_quick(offer, carrier)))
        take(in_time([&] { return on_wire(offer, carrier); }, [](const Row& row) { return row.outcome.has_begun; }));
  }
  out << "\n## The scanning process is killed (SIGKILL)\nNobody commands anything any more: the devices' own watchdogs "
         "act (relay 1 s after its last refresh, arm 500 ms after its last demand).\n\n"
         "| carrier | relay open [ms] | arm at rest [ms] |\n|---|---|---|\n";
  for (const char* carrier : {"can", "serial"}) {
    if (mock_only || !device.empty()) break;
    const Killed k = in_time([&] { return kill_scan(carrier); },
                             [](const Killed& killed) { return killed.opened && killed.rested; });
    out << "| " << k.carrier << " | " << ms(k.opened, k.when) << " | " << ms(k.rested, k.when) << " |\n";
    std::printf("killed on %s: relay open %s ms, arm at rest %s ms\n", carrier, ms(k.opened, k.when).c_str(),
                ms(k.rested, k.when).c_str());
    wrong += !k.opened || !k.rested;
  }
  out << "\n" << scans << " scans, " << wrong << " outside the bounds.\n";
  return wrong == 0 ? 0 : 1;
}

}  // namespace
}  // namespace tankrig::scenarios

int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  using namespace tankrig::scenarios;
  if (argc == 4 && std::strcmp(argv[1], "--scan") == 0) {
    const Outcome o = scan_wire(argv[2], argv[3], fs::path(argv[2]) / "session", nullptr);
    return o.stopped() ? 1 : 0;
  }
  Asked asked;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quick")
      asked.quick = true;
    else if (word == "--mock")
      asked.mock_only = true;
    else if (word == "--only" && i + 1 < argc)
      asked.device = argv[++i];
    else
      asked.file = word;
  }
  return run(asked);
}
