// The cycle's wake-up latency at 1 kHz beside cyclictest's (package rt-tests), in turns in one run.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstring>
#include <map>

#include "rig/executive/cycle.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/machine_witness.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr int kRounds = 8, kCycles = 750;
/// Ours against cyclictest's, all rounds together. The median tells a cycle that is always late, p99 one that often is.
/// Maxima are shown, never judged. They hold on a machine whose processors were there: one that lends them wakes either
/// late by chance.
constexpr double kMostRatio = 3, kAllowance_us = 50;  // of p99
constexpr double kMostMedianRatio = 2, kMedianAllowance_us = 20;
constexpr Duration kBearable = 10ms;  // as long, a processor is away for a sixth of the cycles that p99 leaves out

using Counts = std::map<int, std::uint64_t>;  // by microseconds

Histogram run_cycle() {
  ScanSettings settings;
  settings.park << 0, 0.12, 1.2, 0, 0.1;
  settings.posture = settings.park;
  settings.control.feedback_timeout = 1e9;
  settings.real_time.overruns = 0;
  const ScanPlan plan = make_scan_plan(settings, settings.park);
  testing_support::CallLog log;
  testing_support::FakeArm arm(log, settings.park);
  testing_support::FakeLaser laser(log);
  MonotonicClock clock;
  Executive executive(plan, settings, arm, laser, kCycles);
  Cycle cycle(executive, clock, 1ms, settings.real_time);
  cycle.begin();
  while (cycle.cycles() < kCycles) clock.sleep_until(clock.now() + 100ms);
  cycle.end();
  return cycle.times()->wake_up;
}

/// Nothing if it is not installed.
Counts run_cyclictest() {
  char command[160];
  std::snprintf(command, sizeof command, "cyclictest -q -m -p %d -i 1000 -l %d -h 100000 -t 1 2>/dev/null",
                RealTimeSettings{}.priority, kCycles);
  FILE* out = ::popen(command, "r");
  if (!out) return {};
  char line[256];
  Counts counts;
  while (std::fgets(line, sizeof line, out)) {
    int us = 0;
    unsigned long long count = 0;
    if (line[0] == '#' || std::sscanf(line, "%d %llu", &us, &count) != 2) continue;
    if (count > 0) counts[us] += count;
  }
  return ::pclose(out) == 0 ? counts : Counts{};
}

double quantile(const Counts& counts, double share) {
  std::uint64_t all = 0, seen = 0;
  for (const auto& [us, count] : counts) all += count;
  for (const auto& [us, count] : counts)
    if (static_cast<double>(seen += count) >= share * static_cast<double>(all)) return us;
  return 0;
}

void wake_up_latency(benchmark::State& state) {
  const auto us = [](Duration d) { return static_cast<double>(d.count()) * 1e-3; };
  Histogram ours;
  Duration worst{};
  Counts theirs;
  const testing_support::MachineWitness witness;
  for ([[maybe_unused]] auto _ : state)
    for (int round = 0; round < kRounds; ++round) {
      const Histogram one = run_cycle();
      const Counts other = run_cyclictest();
      if (other.empty()) {
        state.SkipWithError("skipped: cyclictest is not installed (rt-tests), or may not use SCHED_FIFO");
        return;
      }
      one.for_each_bin([&](const Histogram::Bin& bin) {
        for (std::uint64_t n = 0; n < bin.count; ++n) ours.add(Duration{bin.upper});
      });
      worst = std::max(worst, one.max());
      for (const auto& [at, count] : other) theirs[at] += count;
    }
  state.counters["p50_us"] = us(ours.quantile(0.5));
  state.counters["p99_us"] = us(ours.quantile(0.99));
  state.counters["max_us"] = us(worst);
  state.counters["cyclictest_p50_us"] = quantile(theirs, 0.5);
  state.counters["cyclictest_p99_us"] = quantile(theirs, 0.99);
  state.counters["cyclictest_max_us"] = quantile(theirs, 1);
  state.counters["machine_late_ms"] = 1e3 * seconds(witness.latest());
  if (const Duration late = witness.latest(); late > kBearable)
    state.SkipWithError(testing_support::machine_was_late(late, kBearable).c_str());
  else if (us(ours.quantile(0.5)) > kMostMedianRatio * quantile(theirs, 0.5) + kMedianAllowance_us)
    state.SkipWithError("the median is far above cyclictest's");
  else if (us(ours.quantile(0.99)) > kMostRatio * quantile(theirs, 0.99) + kAllowance_us)
    state.SkipWithError("p99 is far above cyclictest's");
}
BENCHMARK(wake_up_latency)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace tankrig
