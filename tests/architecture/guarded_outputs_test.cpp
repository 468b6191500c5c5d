// Nothing in rig/ or apps/ but the guarded outputs can switch a laser on or move an arm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "tests/architecture/include_rule.hpp"

namespace tankrig::testing {
namespace {

/// Lines of a source that could put light or motion on the rig, each "FILE:LINE". A laser's `set` with anything but
/// `false`, and `write_velocity` of anything but rest.
Violations outputs_in(const std::string& file, const std::string& text) {
  static const std::regex light(R"(laser[a-z_]*(\(\))?(\.|->)set\((?!false\)))", std::regex::icase);
  static const std::regex motion(R"((\.|->)write_(velocity|ticks)\((?!JointVector::Zero\(\)\)))");
  Violations found;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number)
    if (std::regex_search(line, light) || std::regex_search(line, motion))
      found.push_back(file + ":" + std::to_string(number));
  return found;
}

TEST(GuardedOutputs, AreTheOnlyWayToLightAndMotion) {
  const std::filesystem::path root = TANKRIG_SOURCE_DIR;
  Violations found;
  int guarded = 0;
  for (const std::string& file : sources_of(root)) {
    if (file.rfind("rig/", 0) != 0 && file.rfind("apps/", 0) != 0) continue;
    std::ifstream stream(root / file, std::ios::binary);
    const Violations here = outputs_in(file, {std::istreambuf_iterator<char>(stream), {}});
    if (file == "rig/safety/guarded_outputs.cpp")
      guarded = static_cast<int>(here.size());
    else
      found.insert(found.end(), here.begin(), here.end());
  }
  EXPECT_THAT(found, ::testing::IsEmpty());
  EXPECT_EQ(guarded, 2) << "one for the laser, one for the arm: else the search finds nothing";
}

TEST(GuardedOutputs, AreMissedWhereTheyAreGoneRound) {
  for (const char* line :
       {"laser_.set(true);", "job.laser.set(on);", "backend->laser().set(true);", "laser->set(x)",
        "arm_.write_velocity(v);", "job_.arm.write_velocity(JointVector::Constant(1));", "arm->write_ticks(t);"})
    EXPECT_EQ(outputs_in("rig/x.cpp", line).size(), 1u) << line;
  for (const char* line : {"laser_.set(false);", "arm.write_velocity(JointVector::Zero());", "controls.set(name, 1);"})
    EXPECT_TRUE(outputs_in("rig/x.cpp", line).empty()) << line;
}

}  // namespace
}  // namespace tankrig::testing
