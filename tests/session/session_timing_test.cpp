// `timing` of session.yaml and timing.csv against the histogram they were made of.
#include "session/reading/session_timing.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "core/settings_table.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

Histogram thousand_of(int step_ns) {
  Histogram h;
  for (int i = 1; i <= 1000; ++i) h.add(Duration{i * step_ns});
  return h;
}

CycleTimes some_times() { return {thousand_of(100), thousand_of(7), thousand_of(3000), 1000, 3, 5}; }

TEST(SessionTiming, ReadsBackWhatItWrites) {
  const SessionTiming timing = session_timing(some_times(), 350);
  EXPECT_NEAR(timing.wake_up.p50, 50, 50 / 64.0);
  EXPECT_NEAR(timing.wake_up.p99, 99, 99 / 64.0);
  EXPECT_EQ(timing.wake_up.max, 100);
  const TemporaryFolder folder;
  const auto file = folder.path() / "session.yaml";
  const auto yaml_of = [](const SessionTiming& t) {
    YAML::Emitter out;
    write_mapping(out, kSessionTimingKeys, t);
    return std::string(out.c_str());
  };
  std::ofstream(file) << yaml_of(timing);
  const SessionTiming read = settings_from(ConfigNode::load(file), kSessionTimingKeys);
  EXPECT_EQ(yaml_of(read), yaml_of(timing));
  EXPECT_EQ(read.missed_cycles, 5u);
  EXPECT_EQ(read.wake_up.p99, timing.wake_up.p99);
  EXPECT_EQ(timing_summary(read).front().second, "1000 cycles at 350 Hz, 3 late, 5 left out");
}

TEST(SessionTiming, TheTableOfBinsHoldsEveryCycle) {
  std::istringstream csv(timing_csv(some_times()));
  std::string line, quantity;
  std::getline(csv, line);
  EXPECT_EQ(line, "quantity,lower_us,upper_us,count");
  std::map<std::string, int> counts;
  while (std::getline(csv, line)) {
    std::istringstream fields(line);
    std::getline(fields, quantity, ',');
    double lower = -1, upper = -1;
    char comma = 0;
    int count = 0;
    fields >> lower >> comma >> upper >> comma >> count;
    EXPECT_LE(lower, upper);
    counts[quantity] += count;
  }
  EXPECT_EQ(counts, (std::map<std::string, int>{{"wake_up", 1000}, {"execution", 1000}, {"period", 1000}}));
}

}  // namespace
}  // namespace tankrig
