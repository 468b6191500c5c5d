// `scan: real_time:` of the rig file, read, refused and written again.
#include "rig/config/scan_section.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

ScanSettings read_scan(const std::string& section) {
  const ConfigNode node = ConfigNode::parse(section, "rig.yaml");
  ScanSettings scan;
  bool read_lux = true;
  read_scan_section(node, false, scan, read_lux);
  node.finish();
  return scan;
}

RealTimeSettings read(const std::string& section) { return read_scan(section).real_time; }

std::string written(const RealTimeSettings& settings) {
  ScanSettings scan;
  scan.real_time = settings;
  return scan_section_yaml(scan, true);
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

TEST(ScanSection, EveryKeyIsInTheReference) {
  std::stringstream page;
  page << std::ifstream(std::string(TANKRIG_SOURCE_DIR) + "/docs/reference/scan_keys.md").rdbuf();
  EXPECT_TRUE(page.str().ends_with("\n\n" + scan_section_table()))
      << "docs/reference/scan_keys.md: put the output of `tankrig init --keys` below its heading";
}

}  // namespace
}  // namespace tankrig
