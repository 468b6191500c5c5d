#include "session/reading/session_timing.hpp"

#include <fmt/core.h>

#include <array>

#include "core/settings_table.hpp"
#include "session/reading/session_yaml.hpp"

namespace tankrig {
namespace {

struct Named {
  const char* words;  // on the screen
  TimingQuantity SessionTiming::*quantity;
};
constexpr std::array<Named, 3> kQuantities{{{"wake-up latency", &SessionTiming::wake_up},
                                            {"execution time", &SessionTiming::execution},
                                            {"period", &SessionTiming::period}}};

constexpr ConfigRange kMicroseconds{0, 1e12};
const Setting<TimingQuantity> kQuantityRows[] = {
    {"p50", &TimingQuantity::p50, kMicroseconds, "", Need::kRequired},
    {"p99", &TimingQuantity::p99, kMicroseconds, "", Need::kRequired},
    {"p99_9", &TimingQuantity::p999, kMicroseconds, "", Need::kRequired},
    {"max", &TimingQuantity::max, kMicroseconds, "", Need::kRequired},
};
constexpr SettingsTable<TimingQuantity> kQuantity{kQuantityRows};

const Setting<SessionTiming> kTimingRows[] = {
    {"cycle_hz", &SessionTiming::cycle_hz, ConfigRange(0, 1e6), "", Need::kRequired},
    {"cycles", &SessionTiming::cycles, "", Need::kRequired},
    {"overruns", &SessionTiming::overruns, "", Need::kRequired},
    {"missed_cycles", &SessionTiming::missed_cycles, "", Need::kRequired},
    {"wake_up_us", &SessionTiming::wake_up, kQuantity, Need::kRequired, YAML::Flow},
    {"execution_us", &SessionTiming::execution, kQuantity, Need::kRequired, YAML::Flow},
    {"period_us", &SessionTiming::period, kQuantity, Need::kRequired, YAML::Flow},
};

double microseconds(Duration d) { return static_cast<double>(d.count()) * 1e-3; }

TimingQuantity quantity_of(const Histogram& h) {
  return {microseconds(h.quantile(0.5)), microseconds(h.quantile(0.99)), microseconds(h.quantile(0.999)),
          microseconds(h.max())};
}

std::string cycles_in_words(const SessionTiming& t) {
  return fmt::format("{} cycles at {:.6g} Hz, {} late, {} left out", t.cycles, t.cycle_hz, t.overruns, t.missed_cycles);
}

}  // namespace

constinit const SettingsTable<SessionTiming> kSessionTimingKeys{kTimingRows};

SessionTiming session_timing(const CycleTimes& times, double cycle_hz) {
  return {cycle_hz,
          times.cycles,
          times.overruns,
          times.missed_cycles,
          quantity_of(times.wake_up),
          quantity_of(times.execution),
          quantity_of(times.period)};
}

std::string timing_csv(const CycleTimes& times) {
  std::string out = "quantity,lower_us,upper_us,count\n";
  const std::pair<const char*, const Histogram*> histograms[] = {
      {"wake_up", &times.wake_up}, {"execution", &times.execution}, {"period", &times.period}};
  for (const auto& [name, histogram] : histograms)
    histogram->for_each_bin([&out, name = name](const Histogram::Bin& bin) {
      out += fmt::format("{},{:.3f},{:.3f},{}\n", name, microseconds(Duration{bin.lower}),
                         microseconds(Duration{bin.upper}), bin.count);
    });
  return out;
}

std::string timing_table(const SessionTiming& t) {
  std::string out = fmt::format("cycle: {}\n{:20} {:>10} {:>10} {:>10} {:>10}\n", cycles_in_words(t), "", "p50 us",
                                "p99 us", "p99.9 us", "max us");
  for (const Named& named : kQuantities) {
    const TimingQuantity& q = t.*named.quantity;
    out += fmt::format("{:20} {:10.1f} {:10.1f} {:10.1f} {:10.1f}\n", named.words, q.p50, q.p99, q.p999, q.max);
  }
  return out;
}

std::vector<std::pair<std::string, std::string>> timing_summary(const SessionTiming& t) {
  std::vector<std::pair<std::string, std::string>> out{{"cycle", cycles_in_words(t)}};
  for (const Named& named : kQuantities) {
    const TimingQuantity& q = t.*named.quantity;
    out.emplace_back(fmt::format("cycle {}", named.words),
                     fmt::format("p50 {:.1f}, p99 {:.1f}, p99.9 {:.1f}, max {:.1f} us", q.p50, q.p99, q.p999, q.max));
  }
  return out;
}

}  // namespace tankrig
