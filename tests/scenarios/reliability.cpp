// Every fault on every device, measured: writes docs/measured/reliability.md, or with --quick checks one fault of every wire.
//
//   reliability [--quick | --mock] [--only "DEVICE [KIND]"] [--lanes N] [FILE.md]
//                                   --mock: the rows of the mock rig only; --lanes: so many at a time
//   reliability --only endings      the scan's own process dies or stands still
#include <stdlib.h>
#include <sys/utsname.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "sim_backends/wire/private_network.hpp"
#include "tests/scenarios/killed_scan.hpp"
#include "tests/scenarios/measured_apart.hpp"
#include "tests/scenarios/page.hpp"
#include "tests/scenarios/wire_rig.hpp"
#include "tests/support/machine_witness.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::scenarios {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using sim::FaultDevice;
using sim::FaultKind;

constexpr int kSkipped = 77;  // as CMakeLists.txt says: also where a row was not judged
constexpr unsigned kLongestTrial = 120;
constexpr char kEndings[] = "endings";

Row on_mock(const Trial& trial) {
  const TemporaryFolder folder;
  return {trial, scan_with_faults({{trial.fault}}, folder.path() / "session"), {}};
}

/// How long until it holds; nothing: never.
std::optional<Duration> time_until(const std::function<bool()>& condition) {
  MonotonicClock clock;
  const Stamp begin = clock.now();
  for (; clock.now() - begin < kWatched; clock.sleep_until(clock.now() + 1ms))
    if (condition()) return clock.now() - begin;
  return {};
}

Row on_wire(const Trial& trial) {
  const TemporaryFolder folder;
  EmulatedRig rig(folder.path(), {{trial.fault}});
  const testing_support::MachineWitness witness;
  Row row{trial, {}, WireMarks{}};
  try {
    row.outcome = scan_wire(folder.path(), to_string(trial.place), folder.path() / "session", &rig);
  } catch (const std::exception& e) {
    row.outcome.status = std::string("not begun: ") + e.what();
  }
  WireMarks& marks = *row.wire;
  const MonotonicClock clock;
  marks.rested_after = time_until([&] { return rig.arm().true_velocity_at(clock.now()).cwiseAbs().maxCoeff() < 1e-3; });
  time_until([&] { return !rig.box().closed(); });
  marks.last_edge = rig.box().last_edge();
  marks.cut = rig.box().opened();
  marks.fed = rig.box().closed();
  marks.off_byte = rig.relay().off_since();
  marks.opened = rig.relay().opened();
  marks.rest = rig.arm().rest_since();
  marks.machine_late = witness.latest();
  marks.contact_closed = rig.relay().relay_closed();
  return row;
}

std::string skipped(bool too_late, Duration machine_late) {
  return too_late ? testing_support::machine_was_late(machine_late, kBearable) : "";
}

/// Of this lane alone: each has cameras on the same addresses.
void enter_network() {
  if (const Status entered = sim::enter_private_network(); !entered) throw std::runtime_error(entered.error().where);
}

Measured measured(const Trial& trial) {
  if (trial.place != Place::kMock) enter_network();
  const Row row = trial.place == Place::kMock ? on_mock(trial) : on_wire(trial);
  const std::string why = broken(row);
  return {page_row(row, why), row.outcome.status, why, row.wire ? skipped(too_late(row), row.wire->machine_late) : ""};
}

Measured measured_ending(const std::string& carrier, Ending ending) {
  enter_network();
  const Killed k = end_scan(carrier, ending);
  const std::string why = broken(k);
  return {page_killed_row(carrier, k, why),
          k.skipped.empty()
              ? "off byte after " + after(k.off_byte, k.when) + " ms, rest after " + after(k.rest, k.when) + " ms"
              : k.skipped,
          why, skipped(too_late(k), k.machine_late)};
}

struct Ended {
  Ending ending;
  std::string carrier;
};

std::vector<Ended> asked_endings(bool quick) {
  std::vector<Ended> all;
  for (const Ending ending : endings())
    for (const char* carrier : {"can", "serial"})
      if (!quick || ending == Ending::kKilled || ending == Ending::kStopped) all.push_back({ending, carrier});
  return all;
}

std::string name(const Trial& trial) {
  const std::string how = argument(trial.fault);
  return std::string(sim::to_string(trial.fault.device)) + ' ' + sim::to_string(trial.fault.kind) +
         (how.empty() ? "" : ", " + how) + ", on " + to_string(trial.place);
}

/// One fault of every wire, and what opens the relay over each carrier.
bool is_quick(const Trial& trial) {
  const auto is = [&](FaultDevice d, FaultKind k) { return trial.fault.device == d && trial.fault.kind == k; };
  if (trial.place == Place::kSerial)
    return is(FaultDevice::kArm, FaultKind::kUnplugged) || is(FaultDevice::kInterlock, FaultKind::kOff);
  return trial.place == Place::kCan &&
         (is(FaultDevice::kArm, FaultKind::kBusOff) || is(FaultDevice::kLaser, FaultKind::kUnplugged) ||
          is(FaultDevice::kCamera, FaultKind::kUnplugged) || is(FaultDevice::kInterlock, FaultKind::kOff) ||
          is(FaultDevice::kLuxMeter, FaultKind::kOff));
}

struct Asked {
  bool quick = false, mock_only = false;
  int lanes = 1;
  std::string device;  ///< or device and kind; empty: all
  fs::path file;

  bool whole() const { return !quick && !mock_only && device.empty(); }
  bool wants(const Trial& t) const {
    const std::string its = sim::to_string(t.fault.device);
    if (!device.empty() && device != its && device != its + ' ' + sim::to_string(t.fault.kind)) return false;
    return quick ? is_quick(t) : !mock_only || t.place == Place::kMock;
  }
};

double load() {
  double average = 0;
  return ::getloadavg(&average, 1) == 1 ? average : 0;
}

std::string machine(const Asked& asked) {
  utsname system{};
  ::uname(&system);
  const std::string release = system.release;
  char text[96];
  std::snprintf(text, sizeof text, ", %u processors, load average %.1f when it began.",
                std::thread::hardware_concurrency(), load());
  return std::string(asked.whole() ? "" : "**A part of the table only.** ") + "This run: " + system.sysname + " " +
         release.substr(0, release.find_first_not_of("0123456789.")) + text;
}

/// A line of the page, and how it is measured.
struct Job {
  std::string name;
  std::function<Measured()> measure;
  std::function<std::string(const std::string& why)> fallback;  ///< the line if there is no other
};

class Run {
 public:
  Run(const Asked& asked, std::size_t all) : all_(all), lanes_(asked.lanes) {
    if (!asked.file.empty()) out_.open(asked.file);
    failed_ = !asked.file.empty() && !out_;
  }

  void write(const std::string& text) {
    out_ << text;
    out_.flush();
  }

  /// In lanes; their lines in order.
  void take(const std::vector<Job>& jobs) {
    std::vector<std::string> lines(jobs.size());
    std::atomic<std::size_t> next = 0;
    std::vector<std::jthread> lanes;
    for (int lane = 0; lane < lanes_; ++lane)
      lanes.emplace_back([&] {
        for (std::size_t i; (i = next++) < jobs.size();) {
          const Stamp begin = clock_.now();
          const Measured m = measured_apart(jobs[i].measure, kLongestTrial, alone_);
          lines[i] = m.line.empty() ? jobs[i].fallback(m.why) : m.line;
          tell(jobs[i].name, clock_.now() - begin, m);
        }
      });
    lanes.clear();
    for (const std::string& line : lines) write(line);
  }

  int finish(std::size_t without_reason) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "\n%zu trials in %.0f s, %zu wrong, %zu not judged; load average at the end %.1f.\n", done_,
                  seconds(clock_.now() - begun_), wrong_, skipped_, load());
    write(text);
    std::printf("%s", text);
    if (failed_ || (out_.is_open() && !out_)) std::fprintf(stderr, "reliability: the page cannot be written\n");
    if (wrong_ > 0 || without_reason > 0 || failed_ || (out_.is_open() && !out_)) return 1;
    return skipped_ > 0 ? kSkipped : 0;
  }

 private:
  void tell(const std::string& name, Duration took, const Measured& m) {
    const std::lock_guard lock(alone_);
    std::printf("[%zu/%zu] %4.0f s: %s (%.1f s): %s%s%s\n", ++done_, all_, seconds(clock_.now() - begun_), name.c_str(),
                seconds(took), m.status.c_str(), m.why.empty() ? "" : "; WRONG: ", m.why.c_str());
    if (m.why.empty() && !m.skipped.empty()) std::printf("%s: %s\n", name.c_str(), m.skipped.c_str());
    std::fflush(stdout);
    wrong_ += !m.why.empty();
    skipped_ += m.why.empty() && !m.skipped.empty();
  }

  MonotonicClock clock_;
  const Stamp begun_ = clock_.now();
  std::ofstream out_;
  std::mutex alone_;  // who prints, and who forks
  std::size_t all_, done_ = 0, wrong_ = 0, skipped_ = 0;
  const int lanes_;
  bool failed_ = false;
};

int run(const Asked& asked) {
  if (!asked.mock_only)
    if (const Status entered = sim::enter_private_network(); !entered) {
      std::fprintf(stderr, "reliability: emulated cameras need a network of their own: %s\n", entered.error().where);
      return kSkipped;
    }
  std::vector<Trial> wanted;
  for (const Trial& trial : trials())
    if (asked.wants(trial)) wanted.push_back(trial);
  const bool ends = !asked.mock_only && (asked.device.empty() || asked.device == kEndings);
  const std::vector<Ended> to_end = ends ? asked_endings(asked.quick) : std::vector<Ended>{};
  Run run(asked, wanted.size() + to_end.size());
  run.write(page_heading(machine(asked)));
  std::vector<Job> jobs;
  for (const Trial& trial : wanted)
    jobs.push_back(
        {name(trial), [trial] { return measured(trial); }, [trial](auto& why) { return page_row(trial, why); }});
  run.take(jobs);
  if (ends) run.write(page_killed_heading());
  jobs.clear();
  for (const auto& [ending, carrier] : to_end)
    jobs.push_back({std::string("scan ") + to_string(ending) + ", on " + carrier,
                    [=] { return measured_ending(carrier, ending); },
                    [=](auto& why) { return page_killed_row(carrier, ending, why); }});
  run.take(jobs);
  run.write(page_absences());
  const std::vector<Absence> absent = absences();
  return run.finish(static_cast<std::size_t>(
      std::ranges::count_if(absent, [](const Absence& absence) { return absence.reason.empty(); })));
}

}  // namespace
}  // namespace tankrig::scenarios

int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  using namespace tankrig::scenarios;
  if (argc == 4 && std::strcmp(argv[1], "--scan") == 0) {
    const Outcome o = scan_wire(argv[2], argv[3], fs::path(argv[2]) / "session", nullptr, true);
    return o.stopped() ? 1 : 0;
  }
  if (argc == 8 && std::strcmp(argv[1], "guardian") == 0) return run_scan_guardian(argv);
  constexpr char kUsage[] =
      "reliability [--quick | --mock] [--only \"DEVICE [KIND]\" | --only endings] [--lanes N] [FILE.md]";
  Asked asked;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quick")
      asked.quick = true;
    else if (word == "--mock")
      asked.mock_only = true;
    else if (word == "--lanes" && i + 1 < argc)
      asked.lanes = std::clamp(std::atoi(argv[++i]), 1, 16);
    else if (word == "--only" && i + 1 < argc)
      asked.device = argv[++i];
    else if (word.starts_with('-'))
      return std::fprintf(stderr, "%s: found %s\n", kUsage, word.c_str()), 1;
    else
      asked.file = word;
  }
  return run(asked);
}
