// Limits, jerk and play of the joints, as a rig file says them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "rig/config/rig_config.hpp"
#include "tests/config/small_rig.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing_support {
namespace {

using namespace std::chrono_literals;

std::string with(const std::string& what, const std::string& by) {
  std::string text = kSmallRig;
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(LimitsSection, KeepsTheLaboratorysThresholdsWhereItSaysNothing) {
  const TemporaryFolder folder;
  const RigConfig rig = load_rig(folder.write("rig.yaml", kSmallRig));
  EXPECT_EQ(rig.scan.limits.current.amperes, 2);
  EXPECT_EQ(rig.scan.limits.current.duration, 1500ms);
  EXPECT_EQ(rig.scan.limits.refusal_margin, 0.05);
  EXPECT_EQ(rig.scan.limits.set_point_step, 0.4);
  EXPECT_EQ(rig.scan.limits.angles[kSlew].lower, rig.arm.limits[kSlew].lower);
  EXPECT_EQ(rig.scan.sweep.jerk, 5);
  EXPECT_EQ(rig.scan.move.jerk, 5);
  EXPECT_THAT(rig.backlash_ticks, testing::Each(0));
}

TEST(LimitsSection, IsReadAndWrittenAgain) {
  const TemporaryFolder folder;
  std::string text =
      with("  dark_frames: 8\n",
           "  dark_frames: 8\n  limits: {beyond_rad: 0.01, refusal_margin_rad: 0.02, velocity_rad_s: 0.6,\n"
           "    ticks_per_s: 1500, velocity_window_ms: 80, set_point_step_rad_s: 0.3, current_a: 1.5,\n"
           "    current_s: 0.5}\n  move: {jerk_rad_s3: 3}\n");
  text.replace(text.find("  motion_limits:"), 0, "  backlash_ticks: [1, 2, 30, 0, 0.5]\n");
  const RigConfig first = load_rig(folder.write("rig.yaml", text));
  const RigConfig again = load_rig(folder.write("again.yaml", resolved_rig_yaml(first, "objects/box.obj")));
  for (const RigConfig* rig : {&first, &again}) {
    const JointLimits& limits = rig->scan.limits;
    EXPECT_EQ(limits.beyond, 0.01);
    EXPECT_EQ(limits.refusal_margin, 0.02);
    EXPECT_EQ(limits.velocity, 0.6);
    EXPECT_EQ(limits.ticks_per_s, 1500);
    EXPECT_EQ(limits.velocity_window, 80ms);
    EXPECT_EQ(limits.set_point_step, 0.3);
    EXPECT_EQ(limits.current.amperes, 1.5);
    EXPECT_EQ(limits.current.duration, 500ms);
    EXPECT_EQ(rig->scan.move.jerk, 3);
    EXPECT_THAT(rig->backlash_ticks, testing::ElementsAre(1, 2, 30, 0, 0.5));
  }
}

TEST(LimitsSection, SaysWhatIsWrongAndWhere) {
  const TemporaryFolder folder;
  const auto complaint = [&](const std::string& text) {
    return message_of<InputError>([&] { load_rig(folder.write("rig.yaml", text)); });
  };
  EXPECT_THAT(complaint(with("  dark_frames: 8\n", "  dark_frames: 8\n  limits: {current_a: 0}\n")),
              testing::HasSubstr("rig.yaml:29: scan.limits.current_a: found '0'"));
  EXPECT_THAT(complaint(with("  dark_frames: 8\n", "  dark_frames: 8\n  limits: {torque: 1}\n")),
              testing::HasSubstr("scan.limits.torque: unknown key"));
  EXPECT_THAT(complaint(with("  motion_limits:", "  backlash_ticks: [1, 2, -3, 0, 0]\n  motion_limits:")),
              testing::HasSubstr("arm.backlash_ticks: found [1, 2, -3, 0, 0], expected five numbers from 0 to 1e+06"));
  EXPECT_THAT(complaint(with("passes: 1}", "passes: 1, jerk_rad_s3: 0}")),
              testing::HasSubstr("scan.sweep.jerk_rad_s3: found '0'"));
}

}  // namespace
}  // namespace tankrig::testing_support
