#include "rig/executive/cycle_times.hpp"

namespace tankrig {

SessionTiming session_timing(const CycleTimes& times, double cycle_hz) {
  SessionTiming t;
  t.cycle_hz = cycle_hz;
  t.cycles = times.cycles;
  t.overruns = times.overruns;
  t.missed_cycles = times.missed_cycles;
  t.wake_up = quantity_of(times.wake_up);
  t.execution = quantity_of(times.execution);
  t.period = quantity_of(times.period);
  return t;
}

std::string timing_csv(const CycleTimes& times) {
  return timing_csv({{"wake_up", &times.wake_up}, {"execution", &times.execution}, {"period", &times.period}});
}

}  // namespace tankrig
