// Nothing but the guarded outputs can switch a laser on or move an arm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "drivers/arm/arm.hpp"
#include "drivers/laser/laser.hpp"
#include "tests/architecture/include_rule.hpp"

namespace tankrig::testing {
namespace {

template <class L>
concept Lights = requires(L& laser) {
  laser.set(true);
};
template <class A>
concept Moves = requires(A& arm, const JointVector& velocity) {
  arm.write_velocity(velocity);
};

struct OpenLaser : Laser {
  Status set(bool on) noexcept override;
};
struct OpenArm : Arm {
  Result<JointVector> write_velocity(const JointVector& velocity) noexcept override;
};

static_assert(!Lights<Laser> && !Moves<Arm>, "the compiler refuses it to everybody but OutputRight");
static_assert(Lights<OpenLaser> && Moves<OpenArm>, "else the two lines above say nothing");

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

/// Those that know more of a laser or an arm than their interfaces, and so could go round them.
const std::regex& driver_headers() {
  static const std::regex headers(
      R"(#\s*include\s*"(drivers/output_right|drivers/laser/relay_laser|drivers/arm/(arm5e|backlash_arm|homing|arm_link|arm_requests|arm_keeper|can_arm_link|serial_arm_link)|sim_backends/(mock/mock_(arm|laser)|faults/faulty_(arm|laser)))\.hpp")");
  return headers;
}

TEST(GuardedOutputs, AreTheOnlyWayToLightAndMotion) {
  EXPECT_THAT(matching(TANKRIG_SOURCE_DIR, driver_headers()),
              ::testing::UnorderedElementsAre(
                  "rig/safety/guarded_outputs.hpp", "apps/tankrig/devices/backend.hpp",
                  "apps/tankrig/devices/device_backend.cpp", "apps/tankrig/devices/mock_backend.cpp",
                  "apps/tankrig/arm/arm_home.cpp", "apps/tankrig/devices/guardian.cpp", "rig/guardian/arm_rest.hpp",
                  "rig/guardian/arm_rest.cpp", "rig/guardian/guardian.cpp", "session/export/export_candump.hpp"))
      << "the guard holds the right; the backends make the drivers; homing moves the arm on its own, laser off; "
         "the guardian sends off and rest; "
         "the export names the arm's identifiers";
}

/// The drivers themselves let anybody who has one move it: nobody who has one does.
TEST(GuardedOutputs, AreCalledInsteadOfADriver) {
  static const std::regex calls(R"((\.|->)\s*(write_velocity|write_ticks)\s*\()");
  EXPECT_THAT(matching(TANKRIG_SOURCE_DIR, calls), ::testing::IsEmpty());
}

}  // namespace
}  // namespace tankrig::testing
