// Nothing but the guarded outputs can switch a laser on or move an arm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "drivers/arm/arm5e.hpp"
#include "drivers/arm/backlash_arm.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "drivers/watchdog/watchdog_box.hpp"
#include "rig/safety/step_watch.hpp"
#include "sim_backends/faults/faulty_laser.hpp"
#include "tests/architecture/include_rule.hpp"

namespace tankrig::testing {
namespace {

template <class L>
concept Lights = requires(L& laser) {
  laser.set(true);
};
struct OpenLaser : Laser {
  Status set(bool on) noexcept override;
};
static_assert(!Lights<Laser> && !Lights<RelayLaser> && !Lights<sim::MockLaser> && !Lights<sim::FaultyLaser>,
              "the compiler refuses it to everybody but the holder of an OutputRight");
static_assert(Lights<OpenLaser>, "else the line above says nothing");

/// Whether anybody can move an arm, with a right of this type that he makes himself.
template <class A, class Right>
concept Moves = requires(A& arm, const JointVector& velocity) {
  arm.write_velocity(Right(), velocity);
};
template <class A, class Right>
concept Drives = requires(A& arm, const TickSpeeds& ticks_per_s) {
  arm.write_ticks(Right(), ticks_per_s);
};
template <class A>
concept MovesBraced = requires(A& arm, const JointVector& velocity, const TickSpeeds& ticks_per_s) {
  arm.write_velocity({}, velocity);
  arm.write_ticks({}, ticks_per_s);
};
/// Whether anybody can say that a safety step was completed.
template <class W, class Right>
concept Completes = requires(W& watch) {
  watch.completed(Right());
};
struct FreeRight {};
struct FreeWatch {
  void completed(const FreeRight& right);
};
static_assert(!Completes<StepWatch, OutputRight> && !Completes<WatchdogBox, OutputRight>, "the guard alone can");
static_assert(Completes<FreeWatch, FreeRight>, "else that says nothing");
struct FreeArm {
  void write_velocity(const FreeRight& right, const JointVector& velocity);
  void write_ticks(const FreeRight& right, const TickSpeeds& ticks_per_s);
};
template <class A>
constexpr bool guarded = !Moves<A, OutputRight> && !Drives<A, OutputRight> && !MovesBraced<A>;
static_assert(guarded<Arm> && guarded<Arm5e> && guarded<BacklashArm>, "nobody can make the right that they ask for");
static_assert(Moves<FreeArm, FreeRight> && Drives<FreeArm, FreeRight> && MovesBraced<FreeArm>,
              "else that says nothing");
static_assert(!std::is_copy_constructible_v<OutputRight>, "nor keep one that is lent");

/// Sources other than drivers, their stand-ins and tests whose text matches `what`.
std::vector<std::string> matching(const std::filesystem::path& root, const std::regex& what) {
  static const std::regex makers("(drivers|sim_backends|tests)/.*");
  std::vector<std::string> found;
  for (const std::string& file : sources_of(root)) {
    if (std::regex_match(file, makers)) continue;
    std::ifstream stream(root / file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    if (std::regex_search(text, what)) found.push_back(file);
  }
  return found;
}

/// Those that know more of the arm's wire than its driver lets out.
const std::regex& driver_headers() {
  static const std::regex headers(
      R"(#\s*include\s*"drivers/arm/(arm_link|arm_requests|arm_keeper|can_arm_link|serial_arm_link)\.hpp")");
  return headers;
}

TEST(GuardedOutputs, AreTheOnlyWayToTheArmsWire) {
  EXPECT_THAT(matching(TANKRIG_SOURCE_DIR, driver_headers()),
              ::testing::UnorderedElementsAre("rig/guardian/arm_rest.hpp", "rig/guardian/arm_rest.cpp",
                                              "rig/guardian/guardian.cpp", "session/export/export_candump.hpp"))
      << "the guardian sends rest; the export names the arm's identifiers";
}

/// Whoever defines a friend of the right has it.
TEST(GuardedOutputs, AndTestsAloneDefineAFriendOfTheRight) {
  static const std::regex definitions(R"((struct|class)\s+(Arm|GuardedOutputs|BenchRight)\s*(final\s*)?(:[^;]*)?\{)");
  EXPECT_THAT(matching(TANKRIG_SOURCE_DIR, definitions),
              ::testing::UnorderedElementsAre("rig/safety/guarded_outputs.hpp"));
}

}  // namespace
}  // namespace tankrig::testing
