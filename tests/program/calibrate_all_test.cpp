// `tankrig calibrate all` on rigs that are not as their drawings say, and what scans with its result are worth.
//
// Bounds are those of the paper's real tank, cut to a fifth and less: 8 mm by laser, 8 mm by stereo.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "core/calibration_file.hpp"
#include "core/text_files.hpp"
#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;

namespace tankrig::test {
namespace {

constexpr double kLaserMean_mm = 1.5, kLaserDeviation_mm = 1.5, kStereoMean_mm = 2.5;

/// calibration.yaml without the times it was made at.
std::string values_of(const fs::path& file) {
  return std::regex_replace(read_whole_file(file), std::regex("made_utc: [^\n]*\n"), "");
}

/// Calibrates the rig that `seed` builds, scans with the result, and holds the scores against the bounds.
class CalibrateAll : public testing::Test {
 protected:
  ProgramRun calibrate(int seed) const {
    return run_tankrig(
        {"calibrate", "all", "--rig", rig_, "--truth-seed", std::to_string(seed), "--data", data_.string(), "--json"});
  }

  void expect_a_good_scan(int seed) const {
    const ProgramRun run =
        run_tankrig({"scan", "--rig", rig_, "--truth-seed", std::to_string(seed), "--calibration",
                     (data_ / "calibration.yaml").string(), "--out", (data_ / "scan").string(), "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const auto scores = run.json();
    const auto millimetres = [&](const char* method, const char* what) {
      const double mm = 1e3 * scores.at(method).at(what).get<double>();
      std::printf("seed %d: %s %s %.3f\n", seed, method, what, mm);
      return mm;
    };
    EXPECT_LE(millimetres("laser", "mean_error_m"), kLaserMean_mm);
    EXPECT_LE(millimetres("laser", "stddev_m"), kLaserDeviation_mm);
    EXPECT_LE(millimetres("stereo", "mean_error_m"), kStereoMean_mm);
  }

  /// Does the calibration hold for the rig that `seed` builds?
  ProgramRun check(int seed) const {
    return run_tankrig({"calibrate", "check", "--rig", "tank-true", "--truth-seed", std::to_string(seed),
                        "--calibration", (data_ / "calibration.yaml").string(), "--out",
                        (data_ / ("check-" + std::to_string(seed))).string(), "--json"});
  }

  std::string rig_ = "tank-true";
  fs::path data_ = scratch_folder() / "calibration";
};

TEST_F(CalibrateAll, MakesARigThatNobodyKnowsScanWithinMillimetresAndTheSameNumbersAgain) {
  constexpr int kSeed = 1;
  RecordProperty("seed", kSeed);
  const ProgramRun run = calibrate(kSeed);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.json()["verdict"], "accepted");
  const auto truth = run.json()["truth"];
  EXPECT_LT(truth["object_as_it_is"]["laser"]["rms_mm"], 1.0);
  EXPECT_LT(truth["object_as_it_is"]["stereo"]["rms_mm"], 1.0);
  EXPECT_LT(truth["object_rms_mm"], 1.0);
  for (const char* picture : {"mono/uncertainty.png", "mono/residuals.png", "mono/coverage.png", "object.png"})
    EXPECT_TRUE(fs::exists(data_ / "report" / picture)) << picture;
  const std::string page = read_whole_file(data_ / "report" / "calibration.html");
  for (const char* shown :
       {"Calibration of tank-true", "accepted", "What the uncertainties cost", "<svg", "data:image/png"})
    EXPECT_THAT(page, HasSubstr(shown));
  expect_a_good_scan(kSeed);

  const ProgramRun holds = check(kSeed), of_another_rig = check(kSeed + 1);
  EXPECT_EQ(holds.exit_code, 0) << holds.err << holds.out;
  EXPECT_TRUE(holds.json()["holds"]);
  EXPECT_EQ(of_another_rig.exit_code, 1) << of_another_rig.err;
  EXPECT_FALSE(of_another_rig.json()["holds"]);

  // What the rig file's own values would have cost.
  const ProgramRun nominal = run_tankrig(
      {"budget", "--rig", "tank-true", "--calibration", (data_ / "calibration.yaml").string(), "--nominal", "--json"});
  ASSERT_EQ(nominal.exit_code, 0) << nominal.err;
  EXPECT_GT(nominal.json()["laser_mm"], 10);
  EXPECT_GT(nominal.json()["stereo_mm"], 10);

  const std::string before = values_of(data_ / "calibration.yaml");
  const ProgramRun again = calibrate(kSeed);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("recorded already"));
  EXPECT_EQ(values_of(data_ / "calibration.yaml"), before);

  // The laser once more, from the same sweeps.
  const fs::path file = data_ / "laser.yaml";
  fs::copy_file(data_ / "calibration.yaml", file);
  const auto laser = [&](const std::string& rig) {
    return run_tankrig({"calibrate", "laser", (data_ / "sheet-before").string(), (data_ / "sheet-behind").string(),
                        "--rig", rig, "--write", file.string(), "--json"});
  };
  const ProgramRun sheet = laser("tank-true");
  ASSERT_EQ(sheet.exit_code, 0) << sheet.err;
  EXPECT_LT(sheet.json()["rms_mm"], 1.0);
  const Calibration all = read_calibration(data_ / "calibration.yaml"), one = read_calibration(file);
  EXPECT_EQ(one.verdict, CalibrationVerdict::kUnchecked);
  EXPECT_LT((one.laser->ePl.normal - all.laser->ePl.normal).norm(), 2e-3);
  EXPECT_NEAR(one.laser->ePl.offset, all.laser->ePl.offset, 1e-3);
  EXPECT_NE(one.laser->made_utc, all.laser->made_utc);
  EXPECT_THAT(laser("tank-sim").err, HasSubstr("rig: found tank-true, expected a calibration of tank-sim"));

  const ProgramRun other = run_tankrig({"calibrate", "all", "--rig", "tank-sim", "--data", data_.string()});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("is of rig tank-true, expected tank-sim"));
  const ProgramRun otherwise_built = calibrate(kSeed + 1);
  EXPECT_EQ(otherwise_built.exit_code, 1);
  EXPECT_THAT(otherwise_built.err, HasSubstr("is of the rig of --truth-seed 1, expected 2"));
}

class CalibrateAllSlow : public CalibrateAll {};
class CalibrateAllSlowRigs : public CalibrateAll, public testing::WithParamInterface<int> {};

TEST_P(CalibrateAllSlowRigs, HoldsTheBoundsHoweverTheRigIsBuilt) {
  RecordProperty("seed", GetParam());
  const ProgramRun run = calibrate(GetParam());
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  expect_a_good_scan(GetParam());
}

/// The paper's Figure 10: 12, 147 and 207 lx, with a sensor that counts photo-electrons.
TEST_F(CalibrateAllSlow, TheLasersCloudIsWholeAtEveryLightLevelOfThePaper) {
  ASSERT_EQ(calibrate(1).exit_code, 0);
  const ProgramRun run = run_tankrig({"experiment", "etc/benchmarks/paper-figure-10.xml", "--rig", rig_, "--sensor",
                                      "emva1288", "--calibration", (data_ / "calibration.yaml").string(), "--out",
                                      (data_ / "experiment").string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  ASSERT_EQ(run.json()["levels"].size(), 3u);
  for (const auto& level : run.json()["levels"]) EXPECT_GE(level["laser"]["of_ceiling"], 0.85) << level;
}

class CalibrateAllSlowWire : public CalibrateAll {};

TEST_F(CalibrateAllSlowWire, HoldsTheBoundsBehindRealDrivers) {
  rig_ = "tank-true-wire";
  const ProgramRun run = calibrate(1);
  if (forbids_private_network(run)) GTEST_SKIP() << run.err;
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  expect_a_good_scan(1);
}

INSTANTIATE_TEST_SUITE_P(Rigs, CalibrateAllSlowRigs, testing::Range(1, 11));

}  // namespace
}  // namespace tankrig::test
