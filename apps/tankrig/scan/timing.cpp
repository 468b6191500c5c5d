#include "apps/tankrig/scan/timing.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "rig/platform/machine.hpp"

namespace tankrig::app {

void keep_timing(SessionWriter& writer, const RigConfig& rig, const ScanResult& result) {
  if (!result.times) return;
  writer.info().timing = session_timing(*result.times, rig.scan.cycle_hz);
  writer.info().platform = platform_facts("/", rig.scan.real_time, result.granted);
  writer.add_text("timing.csv", timing_csv(*result.times));
}

void print_timing(const RigConfig& rig, const ScanResult& result) {
  if (result.times) std::printf("%s", timing_table(session_timing(*result.times, rig.scan.cycle_hz)).c_str());
}

nlohmann::ordered_json timing_json(const SessionTiming& t) {
  const auto quantity = [](const TimingQuantity& q) {
    return nlohmann::ordered_json{{"p50", q.p50}, {"p99", q.p99}, {"p99_9", q.p999}, {"max", q.max}};
  };
  return {{"cycle_hz", t.cycle_hz},
          {"cycles", t.cycles},
          {"overruns", t.overruns},
          {"missed_cycles", t.missed_cycles},
          {"wake_up_us", quantity(t.wake_up)},
          {"execution_us", quantity(t.execution)},
          {"period_us", quantity(t.period)}};
}

}  // namespace tankrig::app
