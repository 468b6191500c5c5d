// Benchmark files: what they mean, and what each kind of mistake is told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <sstream>

#include "bench/benchmark/benchmark.hpp"
#include "bench/benchmark/function.hpp"
#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const std::filesystem::path kCorpus = std::filesystem::path(TANKRIG_SOURCE_DIR) / "tests/fuzz/corpus/benchmark_file";
const std::filesystem::path kBenchmarks = std::filesystem::path(TANKRIG_SOURCE_DIR) / "etc/benchmarks";

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

Benchmark read(const std::string& text) {
  const TemporaryFolder folder;
  return read_benchmark(folder.write("b.xml", text));
}

/// The corpus file with `from` changed to `to` is refused at the line of `at`, in one line that holds `words`.
void expect_refused(const std::string& name, const std::string& from, const std::string& to, const std::string& at,
                    const std::string& words) {
  const std::string text = replaced(text_of(kCorpus / name), from, to);
  const auto end = text.begin() + static_cast<long>(text.find(at));
  const auto line = 1 + std::count(text.begin(), end, '\n');
  try {
    read(text);
    ADD_FAILURE() << "accepted " << to;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("b.xml:" + std::to_string(line) + ": "));
    EXPECT_THAT(error.what(), HasSubstr(words));
    EXPECT_THAT(error.what(), ::testing::Not(HasSubstr("\n")));
  }
}

TEST(BenchmarkFile, ReadsEveryMeasureOfTheVocabulary) {
  const Benchmark b = read_benchmark(kCorpus / "none.xml");
  EXPECT_THAT(b.warnings, IsEmpty());
  ASSERT_THAT(b.measures, SizeIs(15));
  EXPECT_EQ(b.measures[0].kind, MeasureKind::kTime);
  EXPECT_EQ(b.measures[0].start.kind, TriggerKind::kService);
  EXPECT_EQ(b.measures[0].start.target, "startBench");
  EXPECT_TRUE(b.measures[0].stop.position.isApprox(Vector3d(0.5, 0, -std::numbers::pi / 4)));
  EXPECT_TRUE(b.measures[2].position.isApprox(Vector3d(0, 0, 3.65)));
  EXPECT_EQ(b.measures[2].topic, "/pose");
  EXPECT_EQ(b.measures[2].log_s, 0.5);
  EXPECT_THAT(b.measures[4].truth.values, ElementsAre(DoubleEq(std::numbers::pi), 2));
  EXPECT_EQ(b.measures[5].truth.publish_on, "autoInit");
  EXPECT_EQ(b.measures[7].truth.to, "blackbox");
  EXPECT_EQ(b.measures[8].camera, "bowtech1");
  EXPECT_EQ(b.measures[9].arithmetic, Arithmetic::kUwsim);
  EXPECT_EQ(b.measures[9].level_of_detail, 0.01);
  EXPECT_EQ(b.measures[12].start.value, 1.4);
  EXPECT_EQ(b.points(), 1u);
  EXPECT_THAT(b.values(0), IsEmpty());
}

TEST(BenchmarkFile, HasTheReferenceModulesDefaults) {
  const std::string text = replaced(text_of(kCorpus / "none.xml"), "<levelOfDetail>0.01</levelOfDetail>", "");
  const Benchmark b = read(text);
  EXPECT_EQ(b.measures[9].level_of_detail, std::nullopt);
  EXPECT_FALSE(b.measures[9].detailed_to_globals);
  EXPECT_FALSE(b.functions[1].publish);
  EXPECT_EQ(b.functions[1].publish_rate_s, 0.1);
  EXPECT_EQ(b.functions[0].publish_rate_s, 0.5);
}

TEST(BenchmarkFile, ArithmeticOfTheWholeFileHoldsForMeasuresThatSayNone) {
  std::string text = replaced(text_of(kCorpus / "none.xml"), "<benchmark>", "<benchmark arithmetic=\"uwsim\">");
  EXPECT_EQ(read(text).measures[0].arithmetic, Arithmetic::kUwsim);
  text = replaced(text, "<reconstruction3D arithmetic=\"uwsim\">", "<reconstruction3D arithmetic=\"paper\">");
  EXPECT_EQ(read(text).measures[9].arithmetic, Arithmetic::kPaper);
}

TEST(BenchmarkFile, NestedUpdatersAreAProductWithTheInnermostChangingFastest) {
  const Benchmark b = read_benchmark(kCorpus / "nested.xml");
  ASSERT_THAT(b.updaters, SizeIs(4));
  EXPECT_EQ(b.updaters[0].count(), 21u);  // 0 .. 1.02 by 0.05 ends at 1
  EXPECT_EQ(b.points(), 21u * 6 * 3 * 5);
  EXPECT_THAT(b.values(0), ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(b.values(1), ElementsAre(0, 0, 0, 0.5));
  EXPECT_THAT(b.values(5), ElementsAre(0, 0, 1, 0));
  EXPECT_THAT(b.values(b.points() - 1), ElementsAre(1, 0.1, 2, 2));
  EXPECT_EQ(b.updaters[0].value(3), 0.15);
}

TEST(BenchmarkFile, PaperGridHasEveryPointOfFigures8And9) {
  const Benchmark b = read_benchmark(kBenchmarks / "paper-figures-8-9.xml");
  EXPECT_THAT(b.warnings, IsEmpty());
  EXPECT_EQ(b.points(), 3u * 6 * 21);
}

TEST(BenchmarkFile, TakesOlderTagNamesWithAWarning) {
  const Benchmark b = read_benchmark(kCorpus / "older.xml");
  EXPECT_THAT(b.warnings, ElementsAre(HasSubstr("<initialCurrent> is an older name: <initialValue>"),
                                      HasSubstr("<finalCurrent>"), HasSubstr("<initialFog>"), HasSubstr("<finalFog>")));
  EXPECT_EQ(b.updaters[1].count(), 41u);
}

/// The reference module's own files are not ours to keep: TANKRIG_PUBLISHED_BENCHMARKS names their folder.
TEST(BenchmarkFile, PublishedFilesLoadUnchanged) {
  const char* folder = std::getenv("TANKRIG_PUBLISHED_BENCHMARKS");
  if (!folder) GTEST_SKIP() << "TANKRIG_PUBLISHED_BENCHMARKS names no folder of published benchmark files";
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".xml") continue;
    const Benchmark b = read_benchmark(entry.path());
    EXPECT_EQ(b.warnings.empty(), !entry.path().string().ends_with("Recursive.xml")) << entry.path();
    EXPECT_THAT(b.measures, ::testing::Not(IsEmpty()));
    ++files;
  }
  EXPECT_GE(files, 5u);
}

TEST(BenchmarkFile, RefusesWhatItDoesNotKnowWithItsLine) {
  const struct {
    const char *file, *from, *to, *at, *words;
  } cases[] = {
      {"none.xml", "<time>", "<tiem>", "</time>", "does not parse"},
      {"none.xml", "<log>0.5</log>", "<logg>0.5</logg>", "<logg>", "unknown element <logg>"},
      {"none.xml", "<log>0.5</log>", "<log>fast</log>", "fast", "found 'fast', expected a number"},
      {"none.xml", "<log>0.5</log>", "<log>nan</log>", "nan", "found 'nan'"},
      {"none.xml", "<type>position</type>", "<type>onWish</type>", "onWish", "found 'onWish', expected one of: topic"},
      {"none.xml", "<name>elapsed</name>", "<name>a b</name>", "a b", "found 'a b', expected"},
      {"none.xml", "<name>hits</name>", "<name>elapsed</name>", "<collision>", "found 'elapsed' again"},
      {"none.xml", "<target>numbers</target>", "", "<name>offset", "found no <target>"},
      {"none.xml", "arithmetic=\"uwsim\"", "arithmetic=\"mine\"", "mine",
       "found 'mine', expected one of: paper, uwsim"},
      {"none.xml", "arithmetic=\"uwsim\"", "method=\"uwsim\"", "method", "found attribute 'method'"},
      {"none.xml", "type=\"constant\"", "type=\"moving\"", "moving", "expected one of: constant"},
      {"none.xml", "travelled / energy.charge", "travelled / energy.joules", "energy.joules", "joules"},
      {"none.xml", "travelled / energy.charge", "travelled /", "travelled /", "expected an expression over"},
      {"none.xml", "<none/>", "", "<sceneUpdater>", "found 0 elements"},
      {"nested.xml", "<finalValue>1.02</finalValue>", "<finalValue>1.1</finalValue>", "1.1</f", "at most 1"},
      {"nested.xml", "<finalValue>1.02</finalValue>", "<finalValue>-1</finalValue>", "-1", "at least the first value"},
      {"nested.xml", "<step>0.05</step>", "<step>0</step>", "<step>0<", "found '0'"},
      {"nested.xml", "<step>0.05</step>", "<step>1e-6</step>", "1e-6", "more than 100000 steps"},
      {"nested.xml", "<iterations>3</iterations>", "<iterations>2.5</iterations>", "2.5", "whole number"},
      {"nested.xml", "<iterations>3</iterations>", "<iterations>9999</iterations>", "<sceneUpdater>",
       "configurations, expected at most 1000000"},
      {"bag.xml", "<imageDepth>2", "<imageDepth>far", "<imageDepth>", "found 'far', expected a number"},
      {"arm.xml", "<joint>0</joint>", "", "<armPosition>", "found 4 <joint>, expected 5"},
      {"older.xml", "<initialFog>0</initialFog>", "<initialFog>0</initialFog><initialValue>0</initialValue>",
       "<initialFog>", "found <initialFog> beside <initialValue>"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.to);
    expect_refused(c.file, c.from, c.to, c.at, c.words);
  }
}

TEST(BenchmarkFile, BombsAndDepthsAreRefusedAtOnce) {
  EXPECT_THROW(read_benchmark(kCorpus / "deep.xml"), InputError);
  try {
    read_benchmark(kCorpus / "bomb.xml");
    ADD_FAILURE() << "accepted definitions of entities";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("bomb.xml:2: found a DOCTYPE with definitions"));
  }
  const TemporaryFolder folder;
  const auto large = folder.write("large.xml", "<benchmark>" + std::string((1 << 20) + 1, ' ') + "</benchmark>");
  EXPECT_THROW(read_benchmark(large), InputError);
}

TEST(BenchmarkFile, ReadsAlgorithmsAndTheLoopOverThem) {
  const Benchmark b = read_benchmark(kCorpus / "algorithms.xml");
  ASSERT_THAT(b.algorithms, SizeIs(2));
  const Algorithm& mine = b.algorithms[0];
  EXPECT_EQ(mine.program, "bin/mine");
  EXPECT_THAT(mine.arguments, ElementsAre("--fast", "two words"));
  EXPECT_TRUE(mine.by_laser);
  EXPECT_EQ(mine.limits.wall_s, 2.5);
  EXPECT_EQ(mine.limits.cpu_s, 2);
  EXPECT_EQ(mine.limits.memory_bytes, 512U << 20);
  EXPECT_EQ(mine.limits.disk_bytes, 64U << 20);
  EXPECT_EQ(mine.limits.processes, 8);
  EXPECT_FALSE(b.algorithms[1].by_laser);
  EXPECT_EQ(b.algorithms[1].limits.wall_s, RunLimits{}.wall_s);
  EXPECT_EQ(b.points(), 3u);
  EXPECT_STREQ(b.updaters[0].column(), "Algorithm");
  EXPECT_EQ(b.updaters[0].shown(b.values(1)[0]), "mine");

  expect_refused("algorithms.xml", "<name>theirs", "<name>mine", "<algorithm><name>", "'mine' again");
  expect_refused("algorithms.xml", "<name>theirs", "<name>algorithm", "<algorithm><name>",
                 "found 'algorithm', expected");
  expect_refused("algorithms.xml", "<uses>stereo", "<uses>sonar", "<algorithm><name>",
                 "found 'sonar', expected laser or");
  expect_refused("algorithms.xml", "<timeLimit>2.5", "<timeLimit>-1", "<timeLimit>", "expected a number in");
  expect_refused("algorithms.xml", "<program>theirs</program>", "", "<algorithm><name>", "<program>");
  expect_refused("algorithms.xml", "<diskLimit>64", "<diskLimit>1e300", "<diskLimit>", "expected a number in");
}

TEST(BenchmarkFile, TheExampleNamesProgramsBesideIt) {
  const Benchmark b = read_benchmark(kBenchmarks / "../../examples/algorithms/external-algorithms.xml");
  ASSERT_THAT(b.algorithms, SizeIs(4));
  for (const Algorithm& algorithm : b.algorithms) {
    EXPECT_TRUE(algorithm.program.has_parent_path()) << algorithm.program << " would be one of PATH";
    const auto file = b.file.parent_path() / algorithm.program;
    EXPECT_TRUE(file.extension() != ".py" || ::access(file.c_str(), X_OK) == 0) << file;
  }
}

TEST(BenchmarkFile, ReadsErrorsOfTheCalibrationAndLux) {
  const Benchmark b = read_benchmark(kCorpus / "calibration_error.xml");
  ASSERT_THAT(b.updaters, SizeIs(2));
  EXPECT_EQ(b.updaters[0].target, "laser");
  EXPECT_EQ(b.updaters[0].error.axis, 1);
  EXPECT_TRUE(b.updaters[0].error.turns);
  EXPECT_EQ(b.points(), 9u);
  EXPECT_THAT(b.values(5), ElementsAre(0, 207));
  expect_refused("calibration_error.xml", "<error>aboutY", "<error>yaw", "<error>", "found 'yaw', expected x, y, z");
  expect_refused("calibration_error.xml", "<target>laser</target>", "", "<calibrationErrorUpdater>", "<target>");
  expect_refused("calibration_error.xml", "<initialValue>-0.01", "<initialValue>-1", "<initialValue>", "expected");
}

TEST(BenchmarkFile, AForeignReaderAcceptsOurFilesBySchema) {
  if (std::system("command -v xmllint > /dev/null") != 0) GTEST_SKIP() << "no xmllint (Debian package libxml2-utils)";
  const std::string lint = "xmllint --noout --nonet --schema " + (kBenchmarks / "benchmark.xsd").string() + " ";
  std::vector<std::filesystem::path> files;
  for (const auto& folder : {kBenchmarks, kCorpus})
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      if (entry.path().extension() == ".xml") files.push_back(entry.path());
  files.push_back(kBenchmarks / "../../examples/algorithms/external-algorithms.xml");
  ASSERT_GE(files.size(), 8u);
  for (const auto& file : files) {
    const bool hostile = file.filename() == "bomb.xml" || file.filename() == "deep.xml";
    EXPECT_EQ(std::system((lint + file.string() + " 2> /dev/null").c_str()) == 0, !hostile) << file;
  }
  const TemporaryFolder folder;
  const std::string text = replaced(text_of(kCorpus / "none.xml"), "<type>service</type>", "<type>wish</type>");
  EXPECT_NE(std::system((lint + folder.write("b.xml", text).string() + " 2> /dev/null").c_str()), 0);
}

TEST(BenchmarkFunction, ComputesOverDetailsAndHasNoValueWithoutThem) {
  const DetailValues values{{"distance", 3}, {"battery", 2}, {"cloud.coverage", 0.5}};
  EXPECT_EQ(function_value("distance/battery", values), 1.5);
  EXPECT_EQ(function_value("cloud.coverage * 2 + distance", values), 4);
  EXPECT_EQ(function_value("distance/speed", values), std::nullopt);
  EXPECT_EQ(function_value("distance/0", values), std::nullopt);
}

}  // namespace
}  // namespace tankrig
