// `tankrig experiment` as a user runs it: a session for each light level, the figures of the same benchmark on layers, and
// a run that goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <csignal>
#include <filesystem>

#include "tests/program/benchmark_text.hpp"
#include "tests/program/program.hpp"

namespace fs = std::filesystem;

namespace tankrig::test {
namespace {

using ::testing::HasSubstr;

/// Laser, stereo and the frames lost, at these light levels; `inner`: a loop inside.
fs::path levels_file(const std::vector<std::string>& levels, const std::string& inner = "") {
  std::string text = "<benchmark><measures>" + cloud("laser") + cloud("stereo") + "<framesLost><name>lost</name>" +
                     kAlways + "</framesLost></measures>" + kAlways +
                     "<function>laser.coverage</function><sceneUpdater><luxUpdater>";
  for (const std::string& level : levels) text += "<level>" + level + "</level>";
  const fs::path file = scratch_folder() / "levels.xml";
  write_text(file, text + "<interval>0</interval>" + inner + "</luxUpdater></sceneUpdater></benchmark>\n");
  return file;
}

TEST(Experiment, MeasuresItsSessionsAsABenchmarkMeasuresTheirLayers) {
  const fs::path rig = small_rig(scratch_folder() / "rig"), file = levels_file({"30", "100"});
  const fs::path out = scratch_folder() / "out", layers = scratch_folder() / "layers";
  const ProgramRun run =
      run_tankrig({"experiment", file, "--rig", rig, "--out", out, "--seed", "3", "--operator", "somebody", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const ProgramRun bench = run_tankrig({"bench", file, "--rig", rig, "--out", layers, "--seed", "3", "--jobs", "1"});
  ASSERT_EQ(bench.exit_code, 0) << bench.err;
  // The pictures behind the dots, in the order in which they came.
  EXPECT_EQ(read_text(out / "views.jsonl"), read_text(layers / "views.jsonl"));
  const nlohmann::json recorded = points_of(out), simulated = points_of(layers);
  ASSERT_EQ(recorded.size(), 2u);
  ASSERT_EQ(simulated.size(), 2u);
  for (std::size_t point = 0; point < 2; ++point) {
    EXPECT_NEAR(recorded[point]["lux"].get<double>(), point == 0 ? 30 : 100, 1e-6);
    for (const char* measure : {"laser", "stereo"}) {
      EXPECT_GT(recorded[point]["measures"][measure]["coverage"], 0.05) << measure;
      EXPECT_EQ(recorded[point]["measures"][measure], simulated[point]["measures"][measure]) << measure;
    }
    EXPECT_EQ(recorded[point]["measures"]["lost"], simulated[point]["measures"]["lost"]);
  }
  for (const char* session : {"30lx", "100lx"}) {
    const fs::path folder = out / "sessions" / session;
    EXPECT_TRUE(fs::exists(folder / "report.html"));
    EXPECT_THAT(read_text(folder / "session.yaml"), HasSubstr("operator: \"somebody\""));
  }
  const std::string page = read_text(out / "report.html");
  for (const char* text :
       {"Figure 10", "Figure 11", "Figure 12", "sessions&#x2F;100lx", "tankrig experiment levels.xml",
        "<a href=\"#point-1\"><circle", "href=\"sessions&#x2F;30lx&#x2F;report.html\""})
    EXPECT_NE(page.find(text), std::string::npos) << text;
  for (const char* picture : {"coverage.svg", "outliers.svg", "views_outside.png", "views_camera.png", "clouds.png"})
    EXPECT_TRUE(fs::exists(out / "figures" / picture)) << picture;
}

TEST(Experiment, GoesOnWhereItWasStoppedAndRepeatsALevel) {
  const fs::path rig = small_rig(scratch_folder() / "rig"), file = levels_file({"30", "60", "100"});
  const fs::path out = scratch_folder() / "out";
  std::vector<std::string> command{"experiment", file, "--rig", rig, "--out", out, "--json"};
  const std::vector<std::string> without_noise = command;
  command.insert(command.end(), {"--noise", "0.01"});
  const ProgramRun stopped = run_tankrig(command, [&](const std::string& line, int pid) {
    if (line.find("2 of 3: 60lx") != std::string::npos) ::kill(static_cast<pid_t>(pid), SIGINT);
  });
  ASSERT_EQ(stopped.exit_code, 3) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("the same command goes on"));
  EXPECT_TRUE(fs::exists(out / "report.html"));  // of what is there
  const std::string first = read_text(out / "sessions/30lx/session.yaml");

  const ProgramRun whole = run_tankrig(command);
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_EQ(whole.json()["reused"], 1);
  EXPECT_EQ(whole.json()["missing"], 0);
  EXPECT_EQ(read_text(out / "sessions/30lx/session.yaml"), first);
  const nlohmann::json points = points_of(out);
  ASSERT_EQ(points.size(), 3u);

  std::vector<std::string> again = command;
  again.insert(again.end(), {"--again", "60"});
  const ProgramRun repeated = run_tankrig(again);
  ASSERT_EQ(repeated.exit_code, 0) << repeated.err;
  EXPECT_TRUE(fs::exists(out / "sessions/60lx.earlier/session.yaml"));
  EXPECT_TRUE(fs::exists(out / "sessions/60lx/report.html"));
  const nlohmann::json after = points_of(out);
  for (std::size_t point = 0; point < 3; ++point) EXPECT_EQ(after[point]["measures"], points[point]["measures"]);

  for (const char* page : {"report.html", "results.md"})
    EXPECT_THAT(read_text(out / page), HasSubstr(" --noise 0.01")) << page;
  const ProgramRun other = run_tankrig(without_noise);
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(
      other.err,
      HasSubstr("holds results of another run: options is \"--noise 0.01\", expected null; give another --out"));
}

TEST(Experiment, SaysWhatItCannotDoBeforeAnythingMoves) {
  const fs::path rig = small_rig(scratch_folder() / "rig"), out = scratch_folder() / "out";
  const auto refused = [&](const fs::path& file, const std::vector<std::string>& more, const std::string& why) {
    std::vector<std::string> command{"experiment", file, "--rig", rig, "--out", out};
    command.insert(command.end(), more.begin(), more.end());
    const ProgramRun run = run_tankrig(command);
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_THAT(run.err, HasSubstr(why));
    EXPECT_FALSE(fs::exists(out));
  };
  refused(levels_file({"30"}), {"--again", "31"}, "--again: found 31, expected a level of levels.xml");
  refused(levels_file({"30"}), {"--light", "0.5"}, "--light: found it beside a file with light levels");
  refused(levels_file({"30", "900000"}), {}, "its brightest light is");
  refused(levels_file({"30", "30"}), {}, "<level>: found 30 for the second time");
  refused(levels_file({"30</level><initialValue>3</initialValue><level>31"}), {},
          "found <initialValue> beside <level>");
}

TEST(Experiment, LeavesOutWhatPeopleDoNotChangeBetweenTwoRecordings) {
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const fs::path file =
      levels_file({"100"},
                  "<sceneUpdater><cameraNoiseUpdater><initialValue>0</initialValue><finalValue>0.1</finalValue>"
                  "<step>0.1</step><interval>0</interval></cameraNoiseUpdater></sceneUpdater>");
  const ProgramRun run = run_tankrig({"experiment", file, "--rig", rig, "--out", scratch_folder() / "out", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.json()["points"], 1);
  ASSERT_EQ(run.json()["left_out"].size(), 1u);
  EXPECT_THAT(run.json()["left_out"][0].get<std::string>(), HasSubstr("tankrig bench does this on a simulated rig"));
}

}  // namespace
}  // namespace tankrig::test
