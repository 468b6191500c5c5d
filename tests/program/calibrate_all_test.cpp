// `tankrig calibrate all` on rigs that are not as their drawings say, and what scans with its result are worth.
//
// Bounds are those of the paper's real tank, cut to a fifth and less: 8 mm by laser, 8 mm by stereo.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <csignal>
#include <regex>

#include "core/calibration_file.hpp"
#include "core/model_yaml.hpp"
#include "core/text_files.hpp"
#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

namespace tankrig::test {
namespace {

constexpr double kLaserMean_mm = 1.5, kLaserDeviation_mm = 1.5, kStereoMean_mm = 2.5;

/// calibration.yaml without the times it was made at.
std::string values_of(const fs::path& file) {
  return std::regex_replace(read_whole_file(file), std::regex("made_utc: [^\n]*\n"), "");
}

/// A copy of tank-true's rig file in `folder`, its nominal values in drawings.yaml beside it.
fs::path copied_rig(const fs::path& folder) {
  const fs::path etc = fs::path(TANKRIG_SOURCE_DIR) / "etc", rig = folder / "rig.yaml",
                 drawings = folder / "drawings.yaml";
  fs::create_directories(folder);
  fs::copy_file(etc / "rigs/tank-true/rig.yaml", rig);
  fs::copy_file(etc / "rigs/tank-sim/rig.yaml", drawings);
  edit(rig, {{"../tank-sim/rig.yaml", "drawings.yaml"}});
  edit(drawings, {{"../../scenes/tank.xml", (etc / "scenes/tank.xml").string()},
                  {"../../objects/black_box.obj", (etc / "objects/black_box.obj").string()}});
  return rig;
}

/// Of `truth:`, all that moves what the mono camera and the laser see.
const Edits kOtherTruth{
    {"camera_moved_mm: 25", "camera_moved_mm: 200"}, {"camera_turned_deg: 2.5", "camera_turned_deg: 20"},
    {"eye_moved_mm: 2", "eye_moved_mm: 50"},         {"focal_share: 0.02", "focal_share: 0.2"},
    {"joint_zero_deg: 1", "joint_zero_deg: 10"},     {"laser_turned_deg: 1.5", "laser_turned_deg: 10"},
    {"object_moved_mm: 15", "object_moved_mm: 200"}, {"latency_ms: 25", "latency_ms: -400"}};

/// Other drawings of the same rig: centimetres, degrees and percents off, in all that a calibration finds.
const Edits kOtherDrawings{
    {"fx_px: 626.08, fy_px: 682.78, cx_px: 368.93, cy_px: 284.83", "fx_px: 590, fy_px: 720, cx_px: 355, cy_px: 300"},
    {"k1: -0.370, k2: 0.174, p1: -0.0016, p2: 0.0029", "k1: -0.2, k2: 0, p1: 0, p2: 0"},
    {"[0.716, 0.228, 0.585], quaternion_xyzw: [0.418637960, -0.308630971, -0.569861946, 0.636196939]",
     "[0.75, 0.2, 0.61], quaternion_xyzw: [0.439407200, -0.289609291, -0.549259000, 0.649124273]"},
    {"fx_px: 765.4, fy_px: 762.9, cx_px: 315.7, cy_px: 236.8", "fx_px: 800, fy_px: 800, cx_px: 320, cy_px: 240"},
    {"[0.575, 0.215, 0.57], quaternion_xyzw: [0.397810856, -0.280376899, -0.584590789, 0.649144766]",
     "[0.55, 0.23, 0.6], quaternion_xyzw: [0.408877130, -0.299178388, -0.568438936, 0.648219840]"},
    {"fx_px: 765.4, fy_px: 762.9, cx_px: 315.7, cy_px: 236.8", "fx_px: 730, fy_px: 730, cx_px: 320, cy_px: 240"},
    {"[0.589017063, 0.128580300, 0.561102960]", "[0.6, 0.11, 0.54]"},
    {"theta0_rad: 0.139277274", "theta0_rad: 0.16"},
    {"theta0_rad: 1.972222055", "theta0_rad: 1.95"},
    {"ePl: {normal: [1, 0, 0], offset_m: 0.09796}", "ePl: {normal: [0.9992, 0.04, 0], offset_m: 0.104916}"},
    {"origin_e_m: [-0.09796,", "origin_e_m: [-0.105,"},
    {"[-0.26, 0.025, 1.02], quaternion_xyzw: [0.919495956, 0.393099461,",
     "[-0.22, 0.0, 1.0], quaternion_xyzw: [0.940376226, 0.340136082,"}};

/// How many of its sigmas a pose has moved, at most.
double sigmas_apart(const CalibratedPose& a, const CalibratedPose& b) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(b.pose.linear() * a.pose.linear().transpose()));
  const Vector3d moved = b.pose.translation() - a.pose.translation(), turned = turn.angle() * turn.axis();
  return std::max(moved.cwiseAbs().cwiseQuotient(a.sigma_m).maxCoeff(),
                  turned.cwiseAbs().cwiseQuotient(a.sigma_rad).maxCoeff());
}

/// The most of all that a calibration has found.
double sigmas_apart(const Calibration& a, const Calibration& b) {
  double most = std::max({sigmas_apart(*a.stereo, *b.stereo), sigmas_apart(*a.gripper, *b.gripper),
                          sigmas_apart(*a.object, *b.object),
                          (a.laser->ePl.normal - b.laser->ePl.normal).norm() / a.laser->sigma_rad,
                          std::abs(a.laser->ePl.offset - b.laser->ePl.offset) / a.laser->sigma_m});
  const auto add = [&most](double x, double y, double sigma) {
    if (sigma > 0) most = std::max(most, std::abs(x - y) / sigma);
  };
  for (std::size_t joint = 0; joint < a.joints->theta0.size(); ++joint)
    add(a.joints->theta0[joint], b.joints->theta0[joint], a.joints->sigma[joint]);
  for (const CameraCalibration& camera : a.cameras) {
    const CameraCalibration& other = *b.camera(camera.name);
    const CameraModel &m = camera.lens->model, &n = other.lens->model;
    const double x[]{m.fx, m.fy, m.cx, m.cy, m.k1, m.k2, m.p1, m.p2, m.k3},
        y[]{n.fx, n.fy, n.cx, n.cy, n.k1, n.k2, n.p1, n.p2, n.k3};
    for (std::size_t k = 0; k < std::size(x); ++k) add(x[k], y[k], camera.lens->sigma[k]);
    if (camera.mount) most = std::max(most, sigmas_apart(*camera.mount, *other.mount));
    if (camera.time) add(seconds(camera.time->offset), seconds(other.time->offset), seconds(camera.time->sigma));
  }
  return most;
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
    const auto of = [&](const char* method, const char* what) { return scores.at(method).at(what).get<double>(); };
    const auto millimetres = [&](const char* method, const char* what) { return 1e3 * of(method, what); };
    for (const char* method : {"laser", "stereo"})
      std::printf("seed %d: %s %.3f +- %.3f mm, coverage %.1f %%, of ceiling %.1f %%, outliers %.2f %%\n", seed, method,
                  millimetres(method, "mean_error_m"), millimetres(method, "stddev_m"), 100 * of(method, "coverage"),
                  100 * of(method, "coverage_of_ceiling"), 100 * of(method, "outliers"));
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

  /// Does it, by the object, for `rig`?
  ProgramRun check_over_object(const std::string& rig) const {
    static int checks = 0;
    return run_tankrig({"calibrate", "check", "--over", "object", "--rig", rig, "--calibration",
                        (data_ / "calibration.yaml").string(), "--out",
                        (data_ / ("check-object-" + std::to_string(++checks))).string(), "--json"});
  }

  /// Mean error of the scan's points, against the object where `calibration` has it.
  double mean_error_mm(const std::string& method, const fs::path& calibration) const {
    const fs::path pose = data_ / "pose.yaml";
    write_text(pose, yaml_of(read_calibration(calibration).object->pose) + "\n");
    const ProgramRun run = run_tankrig({"evaluate", (data_ / "scan/clouds" / (method + ".ply")).string(), "--object",
                                        "etc/objects/black_box.obj", "--pose", pose.string(), "--json"});
    return run.exit_code == 0 ? 1e3 * run.json()["mean_error_m"].get<double>() : HUGE_VAL;
  }

  /// Where the clicks put the object before and after they are snapped, and what becomes of the scores: with one draw of
  /// clicks they may fall.
  void compare_with_clicks(int seed, const nlohmann::json& truth) const {
    const fs::path snapped = data_ / "calibration.yaml", raw = data_ / "raw.yaml";
    fs::copy_file(snapped, raw);
    const ProgramRun run = run_tankrig({"calibrate", "object", "--corners", (data_ / "corners.yaml").string(),
                                        "--image", (data_ / "object.png").string(), "--object",
                                        "etc/objects/black_box.obj", "--rig", rig_, "--write", raw.string(), "--raw"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const double off = truth["object_rms_mm"], clicked_off = truth["clicked_object_rms_mm"];
    std::printf("seed %d: object off by: as clicked %.2f mm, snapped %.2f mm\n", seed, clicked_off, off);
    for (const char* method : {"laser", "stereo"}) {
      const double clicked_error = mean_error_mm(method, raw), error = mean_error_mm(method, snapped);
      std::printf("seed %d: %s mean error, object as clicked %.2f mm, snapped %.2f mm\n", seed, method, clicked_error,
                  error);
    }
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
  for (const char* judged :
       {"pictures of the board that count: left [0-9]+, mono [0-9]+, right [0-9]+ of 10; [0-9]+ % of the image",
        "left: 10 pictures of the board count", "mono: 12 pictures of the marker count",
        "pictures of the marker that count: mono [0-9]+ of 12; [0-9]+ postures", "mono: 6 pictures of the sheet count",
        "pictures of the sheet that count: mono [0-9]+ of 6; elbow [0-9]+ to [0-9]+ deg"})
    EXPECT_THAT(run.err, ContainsRegex(judged));
  EXPECT_THAT(run.err, Not(HasSubstr(" counts; "))) << "a line for a picture without a fault";
  const auto truth = run.json()["truth"];
  EXPECT_LT(truth["object_as_it_is"]["laser"]["rms_mm"], 1.0);
  EXPECT_LT(truth["object_as_it_is"]["stereo"]["rms_mm"], 1.0);
  EXPECT_LT(truth["object_rms_mm"], 1.0);
  const auto joint = run.json()["joint"];
  std::printf("seed %d: all steps together: %s\n", kSeed, joint["why"].get<std::string>().c_str());
  ASSERT_TRUE(joint.contains("figure")) << joint;
  EXPECT_GT(joint["figure"]["joint"], 0);
  for (const auto& move : joint["moves"]) EXPECT_LT(move["sigmas"], move["limit_sigmas"]) << move;
  const std::string method = read_calibration(data_ / "calibration.yaml").laser->method;
  EXPECT_EQ(method.starts_with("joint refinement"), joint["taken"].get<bool>()) << method;
  for (const char* picture : {"mono/uncertainty.png", "mono/residuals.png", "mono/coverage.png", "object.png"})
    EXPECT_TRUE(fs::exists(data_ / "report" / picture)) << picture;
  const std::string page = read_whole_file(data_ / "report" / "calibration.html");
  for (const char* shown : {"Calibration of tank-true", "accepted", "All steps together", "What the uncertainties cost",
                            "<svg", "data:image/png"})
    EXPECT_THAT(page, HasSubstr(shown));
  expect_a_good_scan(kSeed);
  compare_with_clicks(kSeed, truth);

  const ProgramRun holds = check(kSeed), of_another_rig = check(kSeed + 1);
  EXPECT_EQ(holds.exit_code, 0) << holds.err << holds.out;
  EXPECT_TRUE(holds.json()["holds"]);
  EXPECT_EQ(of_another_rig.exit_code, 1) << of_another_rig.err;
  EXPECT_FALSE(of_another_rig.json()["holds"]);

  // The object itself will do; and it tells that somebody has knocked the projector by half a degree.
  const ProgramRun still_holds = check_over_object("tank-true");
  EXPECT_EQ(still_holds.exit_code, 0) << still_holds.err << still_holds.out;
  EXPECT_TRUE(still_holds.json()["holds"]);
  EXPECT_LT(still_holds.json()["simulated_s"], 120);
  const fs::path knocked = copied_rig(scratch_folder() / "knocked");
  edit(knocked, {{"laser_turned_deg: 1.5", "laser_turned_deg: 2"}});
  const ProgramRun knocked_check = check_over_object(knocked.string());
  EXPECT_EQ(knocked_check.exit_code, 1) << knocked_check.err;
  EXPECT_FALSE(knocked_check.json()["holds"]) << knocked_check.out;

  // What the rig file's own values would have cost.
  const ProgramRun nominal = run_tankrig(
      {"budget", "--rig", "tank-true", "--calibration", (data_ / "calibration.yaml").string(), "--nominal", "--json"});
  ASSERT_EQ(nominal.exit_code, 0) << nominal.err;
  EXPECT_GT(nominal.json()["laser_mm"], 10);
  EXPECT_GT(nominal.json()["stereo_mm"], 10);

  // Once more from the same recordings, with another truth in the rig file and in the sessions: nobody read it.
  const std::string before = values_of(data_ / "calibration.yaml");
  const Calibration all = read_calibration(data_ / "calibration.yaml");
  const fs::path otherwise_true = copied_rig(scratch_folder() / "otherwise-true");
  edit(otherwise_true, kOtherTruth);
  for (const char* session : {"boards", "marker", "sweep", "sheet-before", "sheet-behind"})
    edit(data_ / session / "rig.yaml", kOtherTruth);
  rig_ = otherwise_true.string();
  const ProgramRun again = calibrate(kSeed);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("recorded already"));
  EXPECT_GT(again.json()["truth"]["object_rms_mm"], 50) << "the other truth was not there";
  EXPECT_EQ(values_of(data_ / "calibration.yaml"), before);

  // From drawings that are centimetres, degrees and percents off these: the same, to a hundredth of what is known.
  const fs::path otherwise_drawn = copied_rig(scratch_folder() / "otherwise-drawn");
  edit(otherwise_drawn.parent_path() / "drawings.yaml", kOtherDrawings);
  rig_ = otherwise_drawn.string();
  const fs::path kept = scratch_folder() / "kept.yaml";
  fs::copy_file(data_ / "calibration.yaml", kept);
  const ProgramRun from_other_drawings = calibrate(kSeed);
  ASSERT_EQ(from_other_drawings.exit_code, 0) << from_other_drawings.err;
  EXPECT_LT(sigmas_apart(all, read_calibration(data_ / "calibration.yaml")), 0.01);
  fs::copy_file(kept, data_ / "calibration.yaml", fs::copy_options::overwrite_existing);
  rig_ = "tank-true";

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
  const Calibration one = read_calibration(file);
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

TEST_F(CalibrateAll, TellsOfEachBoardWhetherItCountsAndKeepsWhatAStoppedRunHasTaken) {
  const fs::path rig = copied_rig(scratch_folder() / "rig");
  edit(rig.parent_path() / "drawings.yaml", {{"pictures: 60", "pictures: 20"}});
  rig_ = rig.string();
  const std::vector<std::string> command{"calibrate", "all", "--rig", rig_, "--data", data_.string()};
  const ProgramRun stopped = run_tankrig(command, [](const std::string& line, int pid) {
    if (line.find("mono: 10 pictures of the board count") != std::string::npos) kill(pid, SIGINT);
  });
  EXPECT_NE(stopped.exit_code, 0);
  EXPECT_THAT(stopped.err,
              ContainsRegex("pictures of the board that count: left [0-9]+, mono 1[0-9], right [0-9]+ of 10"));
  EXPECT_FALSE(fs::exists(data_ / "boards-2"));

  // The simulated board is shown in the same places again: those of the stopped run count, and once.
  const ProgramRun on = run_tankrig(command);
  EXPECT_EQ(on.exit_code, 1);
  EXPECT_THAT(on.err, HasSubstr("boards, recorded already"));
  EXPECT_THAT(on.err, HasSubstr("mono: the board is held as in a picture before, move it"));
  EXPECT_THAT(on.err, HasSubstr("expected 10: hold it before this camera; run the same command again"));
  EXPECT_TRUE(fs::exists(data_ / "boards-2"));
  EXPECT_FALSE(fs::exists(data_ / "calibration.yaml"));
}

class CalibrateAllSlow : public CalibrateAll {};
class CalibrateAllSlowRigs : public CalibrateAll, public testing::WithParamInterface<int> {
 protected:
  /// Of each rig that was compared: the object off its true place, snapped and as clicked [mm].
  static std::vector<std::array<double, 2>>& off_mm() {
    static std::vector<std::array<double, 2>> off;
    return off;
  }

  /// One draw of clicks may be better than what it is snapped to; several are not.
  static void TearDownTestSuite() {
    constexpr std::size_t kSeveral = 5;
    if (off_mm().size() < kSeveral) return;
    double snapped = 0, clicked = 0;
    for (const auto& [by_snapping, by_clicks] : off_mm())
      snapped += by_snapping * by_snapping, clicked += by_clicks * by_clicks;
    const auto rigs = static_cast<double>(off_mm().size());
    std::printf("%.0f rigs, object off by, rms: as clicked %.2f mm, snapped %.2f mm\n", rigs, std::sqrt(clicked / rigs),
                std::sqrt(snapped / rigs));
    EXPECT_LT(snapped, clicked) << "squares over " << rigs << " rigs";
  }
};

TEST_P(CalibrateAllSlowRigs, HoldsTheBoundsHoweverTheRigIsBuilt) {
  RecordProperty("seed", GetParam());
  const ProgramRun run = calibrate(GetParam());
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  const auto truth = run.json()["truth"];
  const double off = truth["object_rms_mm"], clicked_off = truth["clicked_object_rms_mm"];
  std::printf("seed %d: object off by: as clicked %.2f mm, snapped %.2f mm\nseed %d: all steps together: %s\n",
              GetParam(), clicked_off, off, GetParam(), run.json()["joint"]["why"].get<std::string>().c_str());
  off_mm().push_back({off, clicked_off});
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
