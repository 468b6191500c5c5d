// `scan: real_time:` of the rig file, read, refused and written again.
#include "rig/config/real_time_section.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

RealTimeSettings read(const std::string& scan_section) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "rig.yaml";
  std::ofstream(file) << "scan:\n" << scan_section;
  const ConfigNode root = ConfigNode::load(file);
  RealTimeSettings settings;
  read_real_time_section(root.child("scan"), settings);
  root.finish();
  return settings;
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
  const std::string text = real_time_section_yaml(s);
  EXPECT_EQ(real_time_section_yaml(read(text)), text);
  EXPECT_EQ(read(text).cpu, 3);
  EXPECT_EQ(real_time_section_yaml(read(real_time_section_yaml({}))), real_time_section_yaml({}));
}

TEST(RealTimeSection, RefusesWhatItDoesNotKnow) {
  for (const char* line : {"cpu: fast", "cpu: -1", "priority: 0", "priority: 99", "pace: arm", "limit: 3",
                           "overruns: {limit: -1}", "overruns: {window_s: 0}"})
    EXPECT_THROW(read(std::string("  real_time: {") + line + "}\n"), InputError) << line;
}

}  // namespace
}  // namespace tankrig
