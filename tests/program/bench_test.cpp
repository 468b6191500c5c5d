// `tankrig bench` as a user runs it: the same bits as a scan, resumed, in shards, and what it says of a bad file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "bench/benchmark/benchmark.hpp"
#include "core/text_files.hpp"
#include "tests/program/benchmark_text.hpp"
#include "tests/program/program.hpp"
#include "tests/support/sanitizers.hpp"

namespace fs = std::filesystem;

namespace tankrig::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string loop(const std::string& name, double first, double last, double step, const std::string& inner = "") {
  return "<sceneUpdater><" + name + "><initialValue>" + std::to_string(first) + "</initialValue><finalValue>" +
         std::to_string(last) + "</finalValue><step>" + std::to_string(step) + "</step><interval>1</interval>" + inner +
         "</" + name + "></sceneUpdater>";
}

fs::path benchmark(const std::string& measures, const std::string& updater, const std::string& function,
                   const std::string& algorithms = "") {
  const fs::path file = scratch_folder() / "benchmark.xml";
  write_text(file, "<benchmark>" + algorithms + "<measures>" + measures + "</measures>" + kAlways + "<function>" +
                       function + "</function>" + updater + "</benchmark>\n");
  return file;
}

TEST(Bench, APointOfTheGridIsTheScanOfThatPointToTheBit) {
  const fs::path rig = small_sweep_rig(scratch_folder() / "rig");
  shrink_stereo_pictures(rig, 2);
  shrink_mono_pictures(rig);
  const fs::path file =
      benchmark(cloud("laser") + cloud("laser_paper") + cloud("stereo") + cloud("stereo_paper"),
                loop("sceneLightUpdater", 0.3, 1, 0.7, loop("cameraNoiseUpdater", 0, 0.04, 0.04)), "laser.coverage");
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run = run_tankrig({"bench", file, "--rig", rig, "--out", out, "--jobs", "2", "--seed", "3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json points = points_of(out);
  ASSERT_EQ(points.size(), 4u);
  const std::string page = read_text(out / "report.html");
  for (const std::size_t point : {std::size_t{1}, std::size_t{2}}) {
    const auto values = points[point]["values"];
    EXPECT_THAT(page, HasSubstr("<a href=\"#point-" + std::to_string(point) + "\"><circle"));
    EXPECT_THAT(page, HasSubstr(" --light " + exact_text(values[0].get<double>()) + " --noise " +
                                exact_text(values[1].get<double>()) + " --seed 3"));
    const fs::path session = scratch_folder() / ("scan" + std::to_string(point));
    const ProgramRun scan = run_tankrig({"scan", "--rig", rig, "--out", session, "--seed", "3", "--light",
                                         values[0].dump(), "--noise", values[1].dump(), "--json"});
    ASSERT_EQ(scan.exit_code, 0) << scan.err;
    for (const char* method : {"laser", "laser_paper", "stereo", "stereo_paper"}) {
      const nlohmann::json measured = points[point]["measures"][method], scanned = scan.json()[method];
      EXPECT_GT(scanned["points"], 100) << method;
      for (const auto& [key, value] : measured["metrics"].items())
        EXPECT_EQ(value, scanned[key]) << method << " " << key;
    }
  }
}

TEST(Bench, GivesTheSameTablesForAnyJobsShardsAndInterruptions) {
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const fs::path file = benchmark(cloud("laser"), loop("sceneLightUpdater", 0, 1, 0.25), "laser.coverage * 100");
  const auto folder = [](const char* name) { return scratch_folder() / name; };
  const auto bench = [&](const fs::path& out, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"bench", file, "--rig", rig, "--out", out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_tankrig(arguments);
  };
  ASSERT_EQ(bench(folder("one"), {"--jobs", "1"}).exit_code, 0);
  const std::string table = read_text(folder("one") / "results.csv");
  ASSERT_EQ(bench(folder("three"), {"--jobs", "3"}).exit_code, 0);
  EXPECT_EQ(read_text(folder("three") / "results.csv"), table);

  // Cut in the middle of a line: that configuration is done again, the others are reused.
  const std::string lines = read_text(folder("one") / "points.jsonl");
  fs::create_directories(folder("cut"));
  write_text(folder("cut") / "points.jsonl", lines.substr(0, lines.size() - 20));
  const ProgramRun resumed = bench(folder("cut"), {"--json"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(resumed.json()["reused"], 4);
  EXPECT_EQ(read_text(folder("cut") / "results.csv"), table);

  ASSERT_EQ(bench(folder("a"), {"--shard", "1/2"}).exit_code, 0);
  const ProgramRun half = run_tankrig({"bench", "merge", file, folder("a"), "--out", folder("half")});
  EXPECT_EQ(half.exit_code, 3);
  EXPECT_THAT(half.err, HasSubstr("3 configurations are missing, the first is 2"));
  ASSERT_EQ(bench(folder("b"), {"--shard", "2/2"}).exit_code, 0);
  ASSERT_EQ(run_tankrig({"bench", "merge", file, folder("a"), folder("b"), "--out", folder("both")}).exit_code, 0);
  EXPECT_EQ(read_text(folder("both") / "results.csv"), table);
  const std::string page = read_text(folder("one") / "report.html");
  EXPECT_THAT(page, HasSubstr("id=\"point-4\""));
  EXPECT_EQ(read_text(folder("both") / "report.html"), page);

  // From its results alone, and not from those of another file or with a line from elsewhere.
  const fs::path both = folder("both");
  for (const char* made : {"results.csv", "report.html"}) fs::remove(both / made);
  EXPECT_EQ(run_tankrig({"report", both}).exit_code, 0);
  EXPECT_EQ(read_text(both / "results.csv"), table);
  EXPECT_THAT(read_text(both / "report.html"), HasSubstr("<polyline"));
  const std::string all = read_text(both / "points.jsonl");
  write_text(both / "points.jsonl", all + "{\"point\": 3, \"values\": [0.75, 1]}\n");
  const ProgramRun foreign = run_tankrig({"report", both});
  EXPECT_EQ(foreign.exit_code, 1);
  EXPECT_THAT(foreign.err, HasSubstr("points.jsonl: configuration 3: values: found [0.75,1], expected [0.75]"));
  write_text(both / "points.jsonl", all);
  write_text(both / "benchmark.xml", read_text(file) + " ");
  EXPECT_THAT(run_tankrig({"report", both}).err, HasSubstr("is not the benchmark that was run"));

  const ProgramRun other = bench(folder("one"), {"--seed", "2"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("holds results of another run: seed is 1, expected 2"));
}

/// Shards of `points` configurations, whose rows are those of `real`, over and over. Returns their bytes.
std::uintmax_t write_shards(const fs::path& folder, std::size_t shards, const Benchmark& benchmark,
                            const std::string& real) {
  const std::size_t points = benchmark.points();
  std::vector<std::string> lines;
  std::istringstream text(real);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  std::uintmax_t bytes = 0;
  for (std::size_t shard = 0; shard < shards; ++shard) {
    std::string out = lines.front() + "\n";
    for (std::size_t point = points * shard / shards; point < points * (shard + 1) / shards; ++point) {
      const std::string& row = lines[1 + point % (lines.size() - 1)];
      out += "{\"point\":" + std::to_string(point) + ",\"values\":" + nlohmann::json(benchmark.values(point)).dump() +
             "," + row.substr(row.find("\"measures\"")) + "\n";
    }
    fs::create_directories(folder / std::to_string(shard));
    write_text(folder / std::to_string(shard) / "points.jsonl", out);
    bytes += out.size();
  }
  return bytes;
}

// TANKRIG_MERGE_POINTS: so many configurations instead, for docs/measured/scale.md.
TEST(Bench, MergesMoreThanItHasInMemory) {
  TANKRIG_SKIP_SANITIZED("memory is measured");
  const char* const wanted = std::getenv("TANKRIG_MERGE_POINTS");
  const std::size_t points = wanted ? std::stoul(wanted) : 8'000, lights = 10;
  const fs::path rig = small_rig(scratch_folder() / "rig"), out = scratch_folder() / "out";
  const fs::path file = benchmark(cloud("laser") + cloud("laser_paper") + cloud("stereo") + cloud("stereo_paper"),
                                  "<sceneUpdater><repeat><iterations>" + std::to_string(points / lights) +
                                      "</iterations><interval>0</interval>" + loop("sceneLightUpdater", 0, 0.9, 0.1) +
                                      "</repeat></sceneUpdater>",
                                  "laser.coverage");
  const fs::path first = scratch_folder() / "first";
  const std::string part = "1/" + std::to_string(points / lights);
  const ProgramRun real = run_tankrig({"bench", file, "--rig", rig, "--out", first, "--shard", part});
  ASSERT_EQ(real.exit_code, 0) << real.err;
  ::unsetenv("GLIBC_TUNABLES");  // by which ./run test lets programs keep what they have freed
  constexpr std::size_t kShards = 100;
  const std::uintmax_t bytes =
      write_shards(scratch_folder() / "shards", kShards, read_benchmark(file), read_text(first / "points.jsonl"));
  const auto merge = [&](std::size_t count, const fs::path& into) {
    std::vector<std::string> words{"bench", "merge", file, "--out", into, "--json"};
    for (std::size_t shard = 0; shard < count; ++shard)
      words.push_back((scratch_folder() / "shards" / std::to_string(shard)).string());
    return run_tankrig(words);
  };
  const ProgramRun one = merge(1, scratch_folder() / "one"), merged = merge(kShards, out);
  ASSERT_EQ(one.exit_code, 3) << one.err;
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(merged.json()["points"], points);
  const double least_mib = one.json()["peak_mib"], peak_mib = merged.json()["peak_mib"];
  const double mib = static_cast<double>(bytes) / (1 << 20);
  EXPECT_LT(peak_mib - least_mib, mib / 5) << "one shard alone takes " << least_mib << " MiB";
  const std::string table = read_text(out / "results.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), static_cast<long>(points) + 1);
  std::printf("%zu configurations, %.0f MiB: merged with %.0f MiB of memory, in %.0f s of processor time\n", points,
              mib, peak_mib, merged.json()["cpu_s"].get<double>());
}

TEST(Bench, MeasuresTheRunAndNamesWhatTheRigCannotMean) {
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const std::string gripper = "<target>end_effector</target>";
  const fs::path file = benchmark(
      "<time><name>t</name><startOn><type>scanPhase</type><target>sweep</target></startOn>"
      "<stopOn><type>scanPhase</type><target>dark_after</target></stopOn></time>"
      "<collision><name>hits</name>" +
          gripper + kAlways +
          "</collision>"
          "<distance><name>way</name>" +
          gripper + "<log>0.5</log>" + kAlways +
          "</distance>"
          "<distance><name>vehicle</name><target>girona500</target>" +
          kAlways +
          "</distance>"
          "<framesLost><name>lost</name>" +
          kAlways + "</framesLost>",
      loop("sweepSpeedUpdater", 0.08, 0.1, 0.02), "way / t");
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run = run_tankrig({"bench", file, "--rig", rig, "--out", out});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("<distance> vehicle: this rig has no body 'girona500' (no free vehicle)"));
  const nlohmann::json points = points_of(out);
  ASSERT_EQ(points.size(), 2u);
  for (const nlohmann::json& point : points) {
    const nlohmann::json& m = point["measures"];
    EXPECT_EQ(m["hits"]["score"], 1);
    EXPECT_GT(m["hits"]["clearance"], 0.02);
    EXPECT_EQ(m["lost"]["lost"], 0);
    EXPECT_TRUE(m["vehicle"]["left_out"]);
    EXPECT_NEAR(point["functions"]["TOTAL"], m["way"]["distance"].get<double>() / m["t"]["time"].get<double>(), 1e-12);
  }
  const double slow = points[0]["measures"]["t"]["time"], fast = points[1]["measures"]["t"]["time"];
  EXPECT_NEAR(slow - fast, 0.08 / 0.08 - 0.08 / 0.1, 0.1);  // the sweep is 0.08 rad long
  EXPECT_THAT(read_text(out / "logs" / "way.csv"), HasSubstr("point,SweepSpeed,time [s],distance [m]\n0,0.08,0.5"));
}

/// An <algorithm> that is a shell script; $1 is the session, $2 the cloud that it has to write.
std::string script(const std::string& name, const std::string& text, const std::string& limits = "",
                   const std::string& uses = "stereo") {
  const fs::path file = scratch_folder() / (name + ".sh");
  write_text(file, "#!/bin/sh\n" + text + "\n");
  fs::permissions(file, fs::perms::owner_all);
  return "<algorithm><name>" + name + "</name><program>./" + name + ".sh</program><uses>" + uses + "</uses>" + limits +
         "</algorithm>";
}

const std::string kHeader =
    "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";

/// On the top of the box, which is at -0.26, 0.025, 1.02 in b.
const std::string kTwoPoints = kHeader + "comment frame b\nend_header\n-0.26 0.025 1.02\n-0.27 0.03 1.02";

TEST(Bench, AProgramThatBehavesBadlyIsAResultAndTheSweepGoesOn) {
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const auto writes = [](const std::string& cloud) { return "cat > $2 <<'END'\n" + cloud + "\nEND"; };
  const std::string& good = kTwoPoints;
  const struct {
    const char *name, *error;
    std::string text, limits = "";
  } bad[] = {
      {"hangs", "ran longer than 0.5 s", "sleep 1000", "<timeLimit>0.5</timeLimit>"},
      {"crashes", "killed by signal 11", writes(good) + "\nkill -SEGV $$"},
      {"fails", "exit code 4: no stripe anywhere", writes(good) + "\necho no stripe anywhere; exit 4"},
      {"bombs", "processes, expected at most 20", "bomb() { bomb | bomb & }; bomb; sleep 1000",
       "<processLimit>20</processLimit>"},
      {"fills", "wrote more than 2 MiB", "exec cat /dev/zero > $2", "<diskLimit>2</diskLimit>"},
      {"forgets", "wrote no cloud", "exit 0"},
      {"links", "is no regular file", "ln -s /etc/passwd $2"},
      {"babbles", "cloud.ply", "printf '\\303\\007\\377 ply\\n%0100000d' 1 > $2"},
      {"cuts", "found 1 points, expected 2", writes(kHeader + "end_header\n0 0 0")},
      {"nothing", "none of its 2 points is finite", writes(kHeader + "end_header\nnan 0 0\n0 inf 0")},
      {"elsewhere", "expected b, the arm's base", writes(kHeader + "comment frame o\nend_header\n0 0 0\n0 0 1")},
      {"far", "no point in the workspace", writes(kHeader + "end_header\n1e30 0 0\n0 -1e30 1")},
  };
  std::string none = kHeader + "end_header";
  none.replace(none.find("vertex 2"), 8, "vertex 0");
  std::string algorithms = script("good", writes(good)) + script("none", writes(none)) + script("gone", "");
  std::string measures = cloud("stereo") + cloud("good") + cloud("none") + cloud("gone");
  fs::remove(scratch_folder() / "gone.sh");
  for (const auto& b : bad) algorithms += script(b.name, b.text, b.limits), measures += cloud(b.name);
  const fs::path file = benchmark(measures, loop("sceneLightUpdater", 0.5, 1, 0.5), "stereo.coverage",
                                  "<algorithms>" + algorithms + "</algorithms>");
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run = run_tankrig({"bench", file, "--rig", rig, "--out", out, "--jobs", "2"});
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("<algorithm> gone: './gone.sh' is no program, expected an executable file; left out"));
  EXPECT_THAT(run.err, HasSubstr("runs good: "));
  const nlohmann::json points = points_of(out);
  ASSERT_EQ(points.size(), 2u);
  for (const nlohmann::json& point : points) {
    const nlohmann::json& m = point["measures"];
    EXPECT_FALSE(point.contains("error"));
    EXPECT_GT(m["stereo"]["coverage"], 0.1);
    EXPECT_NEAR(m["good"]["mean_error"], 0, 1e-6);
    EXPECT_FALSE(m["good"].contains("error"));
    EXPECT_FALSE(m["none"].contains("error"));
    EXPECT_EQ(m["none"]["coverage"], 0);
    EXPECT_TRUE(m["gone"]["left_out"]);
    for (const auto& b : bad) {
      EXPECT_THAT(m[b.name].value("error", "none"), HasSubstr(b.error)) << b.name;
      EXPECT_EQ(m[b.name]["coverage"], 0) << b.name;
      EXPECT_TRUE(m[b.name]["mean_error"].is_null()) << b.name;
    }
  }
  const std::string table = read_text(out / "results.csv");
  EXPECT_THAT(table, HasSubstr("hangs: ran longer than 0.5 s"));
  EXPECT_THAT(table, HasSubstr("fails: exit code 4: no stripe anywhere"));
}

TEST(Bench, AStopEndsItsProgramsTooAndTheRunGoesOnLater) {
  const fs::path rig = small_rig(scratch_folder() / "rig"), pid = scratch_folder() / "pid",
                 out = scratch_folder() / "out";
  // The program stops the benchmark, its parent's parent, when it runs first.
  const std::string text = "[ -e '" + pid.string() + "' ] || { echo $$ > '" + pid.string() +
                           "'; kill -INT $(cut -d' ' -f4 /proc/$PPID/stat); exec sleep 1000; }\n"
                           "cat > $2 <<'END'\n" +
                           kTwoPoints + "\nEND";
  const fs::path file = benchmark(cloud("stops"), loop("sceneLightUpdater", 0.5, 1, 0.5), "stops",
                                  "<algorithms>" + script("stops", text) + "</algorithms>");
  const ProgramRun stopped = run_tankrig({"bench", file, "--rig", rig, "--out", out, "--jobs", "1"});
  EXPECT_EQ(stopped.exit_code, 3) << stopped.err;
  EXPECT_EQ(points_of(out).size(), 0u);
  EXPECT_EQ(::kill(std::stoi(read_text(pid)), 0), -1);
  const ProgramRun again = run_tankrig({"bench", file, "--rig", rig, "--out", out, "--jobs", "1"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(points_of(out).size(), 2u);
}

TEST(Bench, AProgramGetsASessionOfItsCamerasAndNotTheAnswer) {
  const fs::path rig = small_rig(scratch_folder() / "rig");
  // What it finds becomes its last words.
  const std::string look =
      "cd $1 && echo $(ls | tr '\\n' ' ') $(ls frames | tr '\\n' ' ') $(grep -c object session.yaml) $(ls frames/* | "
      "wc -l); "
      "exit 9";
  const fs::path file =
      benchmark(cloud("by_laser") + cloud("by_stereo"), "<sceneUpdater><none/></sceneUpdater>", "by_laser",
                "<algorithms>" + script("by_laser", look, "", "laser") + script("by_stereo", look) + "</algorithms>");
  const fs::path out = scratch_folder() / "out";
  EXPECT_EQ(run_tankrig({"bench", file, "--rig", rig, "--out", out}).exit_code, 3);
  const nlohmann::json m = points_of(out)[0]["measures"];
  EXPECT_THAT(m["by_laser"]["error"].get<std::string>(),
              HasSubstr("cameras frames frames.csv joints.csv rig.yaml session.yaml mono 0"));
  EXPECT_THAT(m["by_stereo"]["error"].get<std::string>(), HasSubstr("session.yaml left right 0"));
}

TEST(Bench, AMethodOnTheLibraryScoresAsTheSameMethodInside) {
  TANKRIG_SKIP_SANITIZED("the program's memory is limited");
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const fs::path file = benchmark(cloud("laser") + cloud("outside"), loop("sceneLightUpdater", 0.5, 0.5, 1),
                                  "outside.coverage - laser.coverage",
                                  "<algorithms><algorithm><name>outside</name><program>" TANKRIG_LIBRARY_CLOUD
                                  "</program><argument>3</argument><uses>laser</uses></algorithm></algorithms>");
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run = run_tankrig({"bench", file, "--rig", rig, "--out", out});
  ASSERT_EQ(run.exit_code, 0) << run.err << read_text(out / "results.csv");
  const nlohmann::json m = points_of(out)[0]["measures"];
  EXPECT_EQ(m["outside"]["metrics"]["points"], m["laser"]["metrics"]["points"]);
  EXPECT_EQ(m["outside"]["drawn"], m["laser"]["drawn"]);
  // A cloud's file has coordinates of 24 bits.
  for (const char* detail : {"mean_error", "coverage", "outliers", "of_ceiling"})
    EXPECT_NEAR(m["outside"][detail], m["laser"][detail].get<double>(), 1e-5) << detail;
}

TEST(Bench, ALoopOverAlgorithmsMeasuresEachAndNamesIt) {
  TANKRIG_SKIP_SANITIZED("the programs' memory is limited");
  const fs::path rig = small_sweep_rig(scratch_folder() / "rig");
  if (std::system("/usr/bin/python3 -c 'import numpy, yaml, PIL'") != 0)
    GTEST_SKIP() << "no numpy, yaml or PIL for Python (Debian packages python3-numpy, python3-yaml, python3-pil)";
  const fs::path examples = fs::path(TANKRIG_SOURCE_DIR) / "examples/algorithms";
  const auto algorithm = [](const std::string& name, const fs::path& program, const std::string& uses) {
    return "<algorithm><name>" + name + "</name><program>" + program.string() + "</program><uses>" + uses +
           "</uses></algorithm>";
  };
  std::string measure = cloud("algorithm");
  measure.replace(measure.find("<name>algorithm"), 15, "<name>chosen");
  const fs::path file = benchmark(measure,
                                  "<sceneUpdater><algorithmUpdater><cloud>laser</cloud><cloud>numpy</"
                                  "cloud><cloud>sgbm</cloud><cloud>pcl</cloud><interval>0"
                                  "</interval></algorithmUpdater></sceneUpdater>",
                                  "chosen.coverage",
                                  "<algorithms>" + algorithm("numpy", examples / "laser_numpy.py", "laser") +
                                      algorithm("sgbm", TANKRIG_SGBM_CLOUD, "stereo") +
                                      algorithm("pcl", TANKRIG_PCL_CLOUD, "laser") + "</algorithms>");
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run = run_tankrig({"bench", file, "--rig", rig, "--out", out});
  ASSERT_EQ(run.exit_code, 0) << run.err << read_text(out / "results.csv");
  const nlohmann::json points = points_of(out);
  ASSERT_EQ(points.size(), 4u);
  const auto chosen = [&](std::size_t i) { return points[i]["measures"]["chosen"]; };
  EXPECT_LT(chosen(0)["mean_error"], 0.0005);
  // The same stripe without a matched filter: a little coarser, over as much of the surface.
  for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
    EXPECT_LT(chosen(i)["mean_error"], 0.002) << i;
    EXPECT_GT(chosen(i)["coverage"].get<double>(), 0.8 * chosen(0)["coverage"].get<double>()) << i;
    EXPECT_TRUE(chosen(i)["drawn"]["by_frame"]) << i;
  }
  EXPECT_LT(chosen(2)["mean_error"], 0.003);
  EXPECT_GT(chosen(2)["of_ceiling"], 0.7);
  EXPECT_THAT(read_text(out / "results.csv"), HasSubstr("\n1,numpy,"));
}

/// "exit code 9: x, y, z, qx, qy, qz, qw" as a pose.
Eigen::Isometry3d told_pose(const nlohmann::json& measure) {
  std::istringstream text(measure["error"].get<std::string>().substr(std::string("exit code 9: ").size()));
  std::vector<double> v;
  for (std::string number; std::getline(text, number, ',');) v.push_back(std::stod(number));
  v.resize(7);
  Eigen::Isometry3d pose(Eigen::Quaterniond(v[6], v[3], v[4], v[5]).normalized());
  pose.pretranslate(Eigen::Vector3d(v[0], v[1], v[2]));
  return pose;
}

TEST(Bench, AWrongCalibrationIsToldToEveryMethodAndCosts) {
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const std::string tell =
      R"(sed -n 's/.*translation_m: \[\(.*\)\], quaternion_xyzw: \[\(.*\)\].*/\1, \2/p' $1/session.yaml; exit 9)";
  const auto wrong = [](const std::string& target, const std::string& error, const std::string& inner) {
    std::string text = loop("calibrationErrorUpdater", 0, 0.01, 0.01, inner);
    return text.insert(text.find("<initialValue>"), "<target>" + target + "</target><error>" + error + "</error>");
  };
  const fs::path file =
      benchmark(cloud("laser") + cloud("told"),
                wrong("sonar", "x", wrong("laser", "aboutY", wrong("mono", "x", wrong("mono", "aboutZ", "")))),
                "laser.mean_error", "<algorithms>" + script("told", tell, "", "laser") + "</algorithms>");
  const fs::path out = scratch_folder() / "out";
  const ProgramRun run = run_tankrig({"bench", file, "--rig", rig, "--out", out});
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("<calibrationErrorUpdater>: this rig has no 'sonar' with a pose, expected laser or"));
  const nlohmann::json points = points_of(out);
  ASSERT_EQ(points.size(), 8u);
  const auto told = [&](std::size_t i) { return told_pose(points[i]["measures"]["told"]); };
  const Eigen::Vector3d along = told(0).linear() * Eigen::Vector3d(0.01, 0, 0);
  EXPECT_LT((told(2).translation() - told(0).translation() - along).norm(), 1e-9);
  EXPECT_LT((told(0).inverse() * told(1)).translation().norm(), 1e-9);
  const Eigen::AngleAxisd turn((told(0).inverse() * told(1)).linear());
  EXPECT_NEAR(turn.angle(), 0.01, 1e-9);
  EXPECT_NEAR(turn.axis().z(), 1, 1e-9);
  const auto error = [&](std::size_t i) { return points[i]["measures"]["laser"]["mean_error"].get<double>(); };
  EXPECT_LT(error(0), 0.0005);
  for (const std::size_t i : {1, 2, 4}) EXPECT_GT(error(i), 2 * error(0)) << i;
}

TEST(Bench, LuxIsTheLightAtTheMeter) {
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const auto points = [&](const std::string& name, const std::string& updater, std::string* said = nullptr) {
    const fs::path out = scratch_folder() / name;
    const ProgramRun run =
        run_tankrig({"bench", benchmark(cloud("stereo"), updater, "stereo"), "--rig", rig, "--out", out});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    if (said) *said = run.err;
    return points_of(out);
  };
  const nlohmann::json by_light = points("light", loop("sceneLightUpdater", 0.5, 1, 0.5));
  ASSERT_EQ(by_light.size(), 2u);
  const double half = by_light[0]["lux"];
  EXPECT_NEAR(by_light[1]["lux"], 2 * half, 1e-9);
  std::string said;
  const nlohmann::json by_lux =
      points("lux", loop("luxUpdater", half, 2 * half - 0.01, half - 0.01, loop("luxUpdater", 0, 9e5, 9e5)), &said);
  EXPECT_THAT(said, HasSubstr("<luxUpdater>: found 900000 lx, expected at most"));
  ASSERT_EQ(by_lux.size(), 2u);
  EXPECT_NEAR(by_lux[0]["lux"], half, 1e-6);
  for (const char* detail : {"mean_error", "coverage"})
    EXPECT_NEAR(by_lux[0]["measures"]["stereo"][detail], by_light[0]["measures"]["stereo"][detail].get<double>(), 1e-5);
}

TEST(Bench, PutsARecordedSessionIntoFog) {
  const fs::path rig = small_rig(scratch_folder() / "rig"), session = scratch_folder() / "monday";
  const ProgramRun scan = run_tankrig({"scan", "--rig", rig, "--out", session, "--seed", "3", "--json"});
  ASSERT_EQ(scan.exit_code, 0) << scan.err;
  const auto fog = [](const std::string& bag) {
    std::string text = loop("bagFogUpdater", 0, 2, 1, loop("sceneLightUpdater", 0.5, 1, 0.5));
    return text.insert(text.find("<initialValue>"), "<bag>" + bag +
                                                        "</bag><imageTopic>/image</imageTopic><infoTopic>/info"
                                                        "</infoTopic><imageDepth>1</imageDepth>");
  };
  const fs::path out = scratch_folder() / "out";
  const fs::path file = benchmark(cloud("laser") + cloud("stereo"), fog("monday"), "stereo.coverage");
  const ProgramRun run = run_tankrig({"bench", file, "--rig", rig, "--out", out, "--jobs", "2"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("<sceneLightUpdater>: its pictures are recorded: fog alone is added to them"));
  const nlohmann::json points = points_of(out);
  ASSERT_EQ(points.size(), 3u);
  for (const char* method : {"laser", "stereo"}) {
    const auto measured = [&](std::size_t i) { return points[i]["measures"][method]; };
    const nlohmann::json scanned = scan.json()[method], clear = measured(0)["metrics"];
    for (const auto& [key, value] : clear.items()) EXPECT_EQ(value, scanned[key]) << method << " " << key;
    // A quarter of the contrast is left in the first fog, three thousandths in the second.
    EXPECT_LE(measured(1)["coverage"], clear["coverage"]) << method;
    EXPECT_LT(measured(2)["coverage"], 0.1 * measured(0)["coverage"].get<double>()) << method;
  }
  EXPECT_TRUE(fs::exists(out / "figures/views_fog.png"));
  const std::string page = read_text(out / "report.html");
  EXPECT_THAT(page, HasSubstr("SHA-256 of the recorded session&#39;s session.yaml"));
  EXPECT_THAT(page, HasSubstr("fog added to the pictures [1/m]"));
  EXPECT_THAT(page, Not(HasSubstr("tankrig scan")));
  const std::string sealed = read_text(session / "session.yaml");
  write_text(session / "session.yaml", sealed + "\n");
  EXPECT_THAT(run_tankrig({"bench", file, "--rig", rig, "--out", out}).err,
              HasSubstr("holds results of another run: session_sha256"));
  write_text(session / "session.yaml", sealed);

  // What is no session is left out, and the rest runs on the simulated rig.
  const ProgramRun bag = run_tankrig({"bench", benchmark(cloud("laser"), fog("pool.bag"), "laser"), "--rig", rig,
                                      "--out", scratch_folder() / "bag", "--json"});
  ASSERT_EQ(bag.exit_code, 0) << bag.err;
  EXPECT_THAT(bag.err,
              HasSubstr("<bagFogUpdater>: found no session 'pool.bag', expected the folder of a recorded one"));
  EXPECT_EQ(bag.json()["points"], 2);
  const fs::path other = small_rig(scratch_folder() / "other", {{"name: \"rig\"", "name: pool"}});
  const ProgramRun foreign = run_tankrig({"bench", benchmark(cloud("laser"), fog("monday"), "laser"), "--rig", other});
  EXPECT_EQ(foreign.exit_code, 1);
  EXPECT_THAT(foreign.err, HasSubstr("was recorded by the rig 'rig', expected --rig rig, found pool"));
}

TEST(Bench, SaysTheCostAndWhatIsWrong) {
  const fs::path rig = small_rig(scratch_folder() / "rig");
  const fs::path file = benchmark(cloud("laser"), loop("sceneLightUpdater", 0, 1, 0.25), "laser");
  const ProgramRun dry = run_tankrig({"bench", file, "--rig", rig, "--dry-run", "--json"});
  ASSERT_EQ(dry.exit_code, 0) << dry.err;
  EXPECT_EQ(dry.json()["points"], 5);
  EXPECT_EQ(dry.json()["scans"], 1);
  EXPECT_GT(dry.json()["expected_s"], 0);
  const ProgramRun shard = run_tankrig({"bench", file, "--rig", rig, "--shard", "3/2"});
  EXPECT_EQ(shard.exit_code, 1);
  EXPECT_THAT(shard.err, HasSubstr("--shard: found '3/2', expected i/n"));
  EXPECT_GT(dry.json()["expected_cpu_s"], 0);
  const auto array = [&](const std::string& option) {
    return run_tankrig({"bench", file, "--rig", rig, "--out", scratch_folder() / "it's", "--slurm", "2", "--sbatch",
                        option, "--dry-run", "--json"});
  };
  const ProgramRun two = array("time=1:00:00");
  ASSERT_EQ(two.exit_code, 0) << two.err;
  EXPECT_EQ(two.json()["scans"], 2);
  const std::string script = two.json()["script"];
  EXPECT_THAT(script, HasSubstr("#SBATCH --time=1:00:00\nexec '" TANKRIG_PROGRAM "' 'bench' '" + file.string() + "' "));
  EXPECT_THAT(script, HasSubstr("it'\\''s'/\"$SLURM_ARRAY_TASK_ID-of-2\"\n"));
  EXPECT_FALSE(fs::exists(scratch_folder() / "it's"));
  EXPECT_THAT(array("--time=1").err, HasSubstr("--sbatch: found '--time=1', expected an option of sbatch"));
  EXPECT_THAT(array("time=1\nrm").err, HasSubstr("--sbatch: found 'time=1?rm', expected"));
  EXPECT_EQ(run_tankrig({"bench", file, "--slurm", "2", "--shard", "1/2"}).exit_code, 2);
  EXPECT_EQ(run_tankrig({"bench"}).exit_code, 2);
  write_text(file, "<benchmark><measure/></benchmark>");
  const ProgramRun bad = run_tankrig({"bench", file});
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_THAT(bad.err, HasSubstr("benchmark.xml:1: found unknown element <measure>"));
}

}  // namespace
}  // namespace tankrig::test
