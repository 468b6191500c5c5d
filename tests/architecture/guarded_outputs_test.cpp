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

/// Sources that know more of a laser or an arm than their interfaces, and so could go round them.
std::vector<std::string> knowing_drivers(const std::filesystem::path& root, const std::vector<std::string>& sources) {
  static const std::regex driver(
      R"(#\s*include\s*"(drivers/output_right|drivers/laser/relay_laser|drivers/arm/(arm5e|backlash_arm|homing|arm_link)|sim_backends/(mock/mock_(arm|laser)|faults/faulty_(arm|laser)))\.hpp")");
  std::vector<std::string> found;
  for (const std::string& file : sources) {
    static const std::regex makers("(drivers|sim_backends|tests)/.*");
    if (std::regex_match(file, makers)) continue;
    std::ifstream stream(root / file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    if (std::regex_search(text, driver)) found.push_back(file);
  }
  return found;
}

TEST(GuardedOutputs, AreTheOnlyWayToLightAndMotion) {
  const std::filesystem::path root = TANKRIG_SOURCE_DIR;
  EXPECT_THAT(knowing_drivers(root, sources_of(root)),
              ::testing::UnorderedElementsAre("rig/safety/guarded_outputs.hpp", "apps/tankrig/backend.hpp",
                                              "apps/tankrig/device_backend.cpp", "apps/tankrig/mock_backend.cpp",
                                              "apps/tankrig/arm_home.cpp"))
      << "the guard holds the right; the backends make the drivers; homing moves the arm on its own, laser off";
}

}  // namespace
}  // namespace tankrig::testing
