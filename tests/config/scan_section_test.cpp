// `scan: real_time:` of the rig file, read, refused and written again.
#include "rig/config/scan_section.hpp"

#include <gtest/gtest.h>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

ScanSettings read_scan(const std::string& section) {
  const ConfigNode node = ConfigNode::parse(section, "rig.yaml");
  ScanSettings scan;
  read_settings(node, kScanKeys, scan, false);
  node.finish();
  return scan;
}

RealTimeSettings read(const std::string& section) { return read_scan(section).real_time; }

std::string written(const RealTimeSettings& settings) {
  ScanSettings scan;
  scan.real_time = settings;
  YAML::Emitter out;
  write_mapping(out, kScanKeys, scan);
  return out.c_str();
}

TEST(RealTimeSection, IsStrictWhereTheFileSaysNothing) {
  const RealTimeSettings s = read("  real_time: {}\n");
  EXPECT_TRUE(s.required);
  EXPECT_TRUE(s.lock_memory);
  EXPECT_EQ(s.priority, 80);
  EXPECT_FALSE(s.cpu);
  EXPECT_EQ(s.overruns, 10);
  EXPECT_EQ(s.window, 1);
  EXPECT_EQ(s.pace, CyclePace::kClock);
}

TEST(RealTimeSection, ReadsBackWhatItWrites) {
  RealTimeSettings s;
  s.required = s.lock_memory = false;
  s.priority = 80;
  s.cpu = 3;
  s.overruns = 7;
  s.window = 0.25;
  s.pace = CyclePace::kDevice;
  EXPECT_EQ(written(read(written(s))), written(s));
  EXPECT_EQ(read(written(s)).cpu, 3);
  EXPECT_EQ(written(read(written({}))), written({}));
}

TEST(RealTimeSection, RefusesWhatItDoesNotKnow) {
  for (const char* line : {"cpu: fast", "cpu: -1", "priority: 0", "priority: 99", "pace: arm", "limit: 3",
                           "overruns: {limit: -1}", "overruns: {window_s: 0}"})
    EXPECT_THROW(read(std::string("  real_time: {") + line + "}\n"), InputError) << line;
}

}  // namespace
}  // namespace tankrig
