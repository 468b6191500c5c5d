// The house's include rule holds in the tree, and the checker notices where it would not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/architecture/include_rule.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// What the checker says of a source at `file` that includes `path`, where every path from the root exists.
Violations including(const std::string& file, const std::string& path) {
  return check_source(file, "// A part of the rig.\n#include \"" + path + "\"\n",
                      [](const std::string&) { return true; });
}

TEST(Architecture, HoldsInTheWholeTree) {
  const std::filesystem::path root = TANKRIG_SOURCE_DIR;
  ASSERT_THAT(sources_of(root), ::testing::Contains("core/time.hpp"));
  ASSERT_THAT(sources_of(root), ::testing::Contains("tests/architecture/architecture_test.cpp"));
  const Violations found = check_tree(root);
  std::string report;
  for (const std::string& violation : found) report += violation + "\n";
  EXPECT_TRUE(found.empty()) << report;
}

TEST(Architecture, LetsEveryFolderIncludeWhatIsBelowIt) {
  EXPECT_THAT(including("core/frames.cpp", "core/frames.hpp"), IsEmpty());
  EXPECT_THAT(including("drivers/arm/arm.hpp", "core/time.hpp"), IsEmpty());
  EXPECT_THAT(including("sim_backends/mock/mock_arm.hpp", "drivers/arm/arm.hpp"), IsEmpty());
  EXPECT_THAT(including("rig/executive/executive.hpp", "drivers/arm/arm.hpp"), IsEmpty());
  EXPECT_THAT(including("reconstruction/stripe/stripe.hpp", "core/frames.hpp"), IsEmpty());
  EXPECT_THAT(including("rig/capture/frame_joiner.hpp", "session/recording/event_kinds.hpp"), IsEmpty());
  EXPECT_THAT(including("session/export/export_candump.cpp", "drivers/can/can_log.hpp"), IsEmpty());
  EXPECT_THAT(including("apps/tankrig/main.cpp", "sim_backends/world/tank_world.hpp"), IsEmpty());
  EXPECT_THAT(including("tests/world/world_test.cpp", "sim_backends/world/tank_world.hpp"), IsEmpty());
}

TEST(Architecture, RefusesEveryForbiddenPair) {
  const std::pair<const char*, const char*> forbidden[] = {
      {"core/frames.hpp", "drivers/arm/arm.hpp"},
      {"core/frames.hpp", "session/reading/session.hpp"},
      {"drivers/arm/arm.hpp", "session/reading/session.hpp"},
      {"drivers/arm/arm.hpp", "sim_backends/world/tank_world.hpp"},
      {"sim_backends/mock/mock_arm.hpp", "rig/executive/executive.hpp"},
      {"rig/executive/executive.hpp", "sim_backends/world/tank_world.hpp"},
      {"rig/executive/executive.hpp", "reconstruction/cloud/cloud.hpp"},
      {"rig/executive/executive.hpp", "rig/scan/scan.hpp"},
      {"rig/plan/scan_plan.hpp", "rig/executive/executive.hpp"},
      {"session/reading/session.hpp", "rig/config/rig_config.hpp"},
      {"reconstruction/stripe/stripe.hpp", "session/reading/session.hpp"},
      {"reconstruction/stripe/stripe.hpp", "drivers/camera/camera.hpp"},
      {"calibration/hand_eye.hpp", "reconstruction/cloud/cloud.hpp"},
      {"bench/metrics/metrics.hpp", "rig/executive/executive.hpp"},
      {"bench/metrics/metrics.hpp", "session/reading/session.hpp"},
      {"rig/plan/scan_plan.hpp", "session/reading/session.hpp"},
      {"rig/config/rig_config.hpp", "session/reading/session.hpp"},
      {"rig/executive/executive.hpp", "session/recording/session_writer.hpp"},
      {"session/reading/session.hpp", "drivers/arm/arm.hpp"},
      {"session/recording/session_writer.hpp", "session/export/export_csv.hpp"},
      {"bench/metrics/metrics.hpp", "sim_backends/world/tank_world.hpp"},
      {"bench/metrics/metrics.hpp", "apps/tankrig/command.hpp"},
      {"pipeline/score_session.hpp", "rig/config/rig_config.hpp"},
      {"pipeline/score_session.hpp", "drivers/arm/arm.hpp"},
      {"pipeline/score_session.hpp", "sim_backends/world/tank_world.hpp"},
      {"session/reading/session.hpp", "apps/tankrig/command.hpp"},
      {"tests/rig/rig_test.cpp", "apps/tankrig/command.hpp"},
      {"apps/tankrig/main.cpp", "tests/world/render_scene.hpp"},
  };
  for (const auto& [file, path] : forbidden)
    EXPECT_THAT(including(file, path), ElementsAre(HasSubstr(std::string(file) + ":2: includes " + path)));
}

TEST(Architecture, WantsIncludePathsFromTheRoot) {
  const Exists exists = [](const std::string& path) { return path == "core/time.hpp"; };
  const auto lines = [&](const std::string& line) {
    return check_source("core/clock.hpp", "// A clock.\n" + line, exists);
  };
  EXPECT_THAT(lines("#include \"core/time.hpp\"\n"), IsEmpty());
  EXPECT_THAT(lines("#include \"time.hpp\"\n"), ElementsAre(HasSubstr("no path from the root")));
  EXPECT_THAT(lines("  #  include \"../core/time.hpp\"  // near\n"), ElementsAre(HasSubstr("no path from the root")));
  EXPECT_THAT(lines("#include <core/time.hpp>\n"), ElementsAre(HasSubstr("without quotes")));
  EXPECT_THAT(lines("#include <vector>\n"), IsEmpty());
}

TEST(Architecture, WantsAFirstLineThatSaysWhatLivesThere) {
  const Exists exists = [](const std::string&) { return true; };
  EXPECT_THAT(check_source("core/a.hpp", "#pragma once\n", exists),
              ElementsAre(HasSubstr("core/a.hpp:1: the first line")));
  EXPECT_THAT(check_source("core/a.hpp", "#include \"core/a.hpp\"\n", exists), SizeIs(1));
  EXPECT_THAT(check_source("core/a.cpp", "#include \"core/b.hpp\"\n", exists), SizeIs(1));
  EXPECT_THAT(check_source("core/a.cpp", "#include \"core/a.hpp\"\n", exists), IsEmpty());
  EXPECT_THAT(check_source("tests/core/a_test.cpp", "#include \"core/a.hpp\"\n", exists), IsEmpty());
  EXPECT_THAT(check_source("core/a.hpp", "", exists), SizeIs(1));
  EXPECT_THAT(check_source("core/a.hpp", "// A thing.\n#pragma once\n", exists), IsEmpty());
}

TEST(Architecture, KnowsEveryFolder) {
  EXPECT_THAT(including("helpers/a.hpp", "core/time.hpp"), ElementsAre(HasSubstr("outside the folders")));
  EXPECT_THAT(including("main.cpp", "core/time.hpp"), ElementsAre(HasSubstr("outside the folders")));
}

TEST(Architecture, ReadsTheFilesOfATree) {
  const TemporaryFolder folder;
  const std::filesystem::path root = folder.path() / "architecture tree";
  folder.write("architecture tree/core/a.hpp", "// A.\n");
  folder.write("architecture tree/rig/executive/b.cpp", "// B.\n#include \"core/a.hpp\"\n#include \"core/gone.hpp\"\n");
  folder.write("architecture tree/build-debug/core/generated.cpp", "int x;\n");
  folder.write("architecture tree/.git/c.cpp", "int x;\n");
  EXPECT_THAT(sources_of(root), ElementsAre("core/a.hpp", "rig/executive/b.cpp"));
  EXPECT_THAT(check_tree(root), ElementsAre(HasSubstr("rig/executive/b.cpp:3: includes \"core/gone.hpp\"")));
}

}  // namespace
}  // namespace tankrig::testing
