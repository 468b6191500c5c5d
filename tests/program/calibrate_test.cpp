// `tankrig calibrate` as an experimenter meets it: pictures of boards in, camera files and calibration.yaml out.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "calibration/intrinsics/board_bundle.hpp"
#include "core/angles.hpp"
#include "core/calibration_file.hpp"
#include "core/camera_file.hpp"
#include "core/model_yaml.hpp"
#include "core/text_files.hpp"
#include "rig/config/rig_config.hpp"
#include "sim_backends/world/port_rays.hpp"
#include "tests/board_calibration/generated_boards.hpp"
#include "tests/hand_eye/generated_postures.hpp"
#include "tests/object_pose/drawn_box.hpp"
#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using testing::HasSubstr;

namespace tankrig::test {
namespace {

constexpr std::uint64_t kSeed = 1;

/// Six pictures of a checkerboard by a camera of 320 x 240 pixels.
class CalibrateTest : public testing::Test {
 protected:
  CalibrateTest() {
    const BoardTarget target = checkerboard("7x5");
    std::mt19937_64 random(kSeed);
    RecordProperty("seed", std::to_string(kSeed));
    fs::create_directories(data_);
    for (const Transform& cMt : many_places(camera_, target, 6, random))
      cv::imwrite((data_ / fmt::format("board{:02}.png", ++pictures_)).string(),
                  picture_of(camera_, cMt, checkerboard_print(target)));
  }
  ProgramRun calibrate(const std::vector<std::string>& more) const {
    std::vector<std::string> words{"calibrate", "camera",      "--data", data_.string(), "--pattern",
                                   "7x5",       "--square-mm", "30",     "--model",      "k1k2p1p2"};
    words.insert(words.end(), more.begin(), more.end());
    return run_tankrig(words);
  }

  CameraModel camera_{320, 240, 265, 280, 165, 123, -0.28, 0.09, 0.001, -0.0007, 0};
  fs::path folder_ = scratch_folder(), data_ = folder_ / "pictures";
  int pictures_ = 0;
};

TEST_F(CalibrateTest, FindsTheCameraOfPicturesAndWritesItsFileInAnotherProgramsFormat) {
  const fs::path out = folder_ / "camera.cameramodel";
  const ProgramRun run = calibrate({"--out", out.string(), "--report", (folder_ / "report").string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_LT(run.json()["rms_px"], 0.2);
  const CameraModel found = read_camera_file(out);
  EXPECT_NEAR(found.fx, camera_.fx, 3);
  EXPECT_NEAR(found.fy, camera_.fy, 3);
  for (const char* name : {"coverage.png", "residuals.png", "uncertainty.png", "calibration.json"})
    EXPECT_TRUE(fs::exists(folder_ / "report" / name)) << name;
}

TEST_F(CalibrateTest, LeavesOutAPictureWithoutABoardByName) {
  cv::imwrite((data_ / "hand.png").string(), cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  const ProgramRun run = calibrate({"--json"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("hand.png: found no checkerboard"));
  EXPECT_EQ(run.json()["not_found"]["hand.png"], "found no checkerboard, expected 7 x 5 corners");
}

TEST_F(CalibrateTest, NamesPicturesOfAnotherSizeAndFoldersWithoutPairs) {
  cv::imwrite((data_ / "board99.png").string(), cv::Mat(200, 320, CV_8UC1, cv::Scalar(90)));
  const ProgramRun run = calibrate({});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("board99.png"));
  EXPECT_THAT(run.err, HasSubstr("as in board01.png"));
  const ProgramRun pairs =
      run_tankrig({"calibrate", "stereo", "--data", data_.string(), "--pattern", "7x5", "--square-mm", "30"});
  EXPECT_EQ(pairs.exit_code, 1);
  EXPECT_THAT(pairs.err, HasSubstr("holds no pairs, expected left01.png"));
}

TEST_F(CalibrateTest, WritesNoLensForARigsCameraOfAnotherSize) {
  const fs::path file = folder_ / "calibration.yaml";
  const ProgramRun run = calibrate({"--name", "mono", "--write", file.string(), "--rig", "tank-sim"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("found pictures of 320 x 240 px, expected the 720 x 576 px of the rig's camera mono"));
  EXPECT_FALSE(fs::exists(file));
}

/// A folder of marker poses of tank-sim's arm before its mono camera, a fifth of a millimetre off.
fs::path marker_poses(const fs::path& folder) {
  fs::create_directories(folder);
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise(0, 2e-4);
  std::string text = "views:\n";
  for (const HandEyeView& view : testing_support::GeneratedPostures{}.problem().views) {
    const Transform cMg = view.cMg * make_transform_rpy({noise(random), noise(random), noise(random)},
                                                        {noise(random), noise(random), noise(random)});
    const JointVector& q = *view.q;
    text += fmt::format("  - {{cMg: {}, q_rad: [{}, {}, {}, {}, {}]}}\n", yaml_of(cMg), q[0], q[1], q[2], q[3], q[4]);
  }
  write_text(folder / "hand_eye.yaml", text);
  return folder;
}

TEST(CalibrationOfARig, IsWrittenKeptByAScanAndWarnedOf) {
  const fs::path folder = scratch_folder(), file = folder / "calibration.yaml";
  const std::string rig = small_rig(folder / "rig").string();
  const ProgramRun hand_eye = run_tankrig({"calibrate", "hand-eye", "--data", marker_poses(folder / "marker").string(),
                                           "--rig", rig, "--write", file.string(), "--json"});
  ASSERT_EQ(hand_eye.exit_code, 0) << hand_eye.err;
  const Calibration written = read_calibration(file);
  ASSERT_TRUE(written.camera("mono") && written.camera("mono")->mount && written.gripper);
  const Vector3d truth(0.716, 0.228, 0.585);
  const CalibratedMount& mount = *written.camera("mono")->mount;
  EXPECT_LT((mount.pose.translation() - truth).norm(), 1e-3);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(std::abs(mount.pose.translation()[k] - truth[k]), 4 * mount.sigma_m[k]);
    EXPECT_LT(mount.sigma_m[k], 1e-3);
  }
  EXPECT_EQ(mount.data_sha256.size(), 64u);
  EXPECT_EQ(written.verdict, CalibrationVerdict::kUnchecked);

  const fs::path session = folder / "session";
  const ProgramRun scan =
      run_tankrig({"scan", "--rig", rig, "--calibration", file.string(), "--out", session.string()});
  EXPECT_EQ(scan.exit_code, 0) << scan.err;
  EXPECT_THAT(scan.err, HasSubstr("was never judged on data that was held back"));
  EXPECT_EQ(read_text(session / "calibration.yaml"), read_text(file));

  const auto warned = [&](const Edits& edits, const std::string& of) {
    const fs::path other = folder / "other.yaml";
    fs::copy_file(file, other, fs::copy_options::overwrite_existing);
    edit(other, edits);
    return run_tankrig({"scan", "--rig", of, "--calibration", other.string(), "--dry-run"}).err;
  };
  EXPECT_THAT(warned({{"verdict: unchecked", "verdict: rejected"}}, rig), HasSubstr("was rejected: calibrate again"));
  EXPECT_THAT(warned({{written.made_utc, "2020-01-31T12:00:00Z"}}, rig), HasSubstr(" days old"));
  EXPECT_THAT(warned({}, "tank-true"), HasSubstr("is of the rig " + written.rig + ", this is tank-true"));
  EXPECT_THAT(warned({{written.rig_sha256, std::string(64, '0')}}, rig), HasSubstr("when arm or cameras"));
}

RigConfig tank_sim() { return load_rig(fs::path(TANKRIG_SOURCE_DIR) / "etc/rigs/tank-sim/rig.yaml"); }

/// Both eyes of tank-sim before a checkerboard.
struct Eyes {
  const RigConfig rig = tank_sim();
  const CameraModel left = rig.find_camera(CameraRole::kLeft)->model,
                    right = rig.find_camera(CameraRole::kRight)->model;
  const Transform rightMleft =
      rig.find_camera(CameraRole::kRight)->bMc.inverse() * rig.find_camera(CameraRole::kLeft)->bMc;
  const BoardTarget target = checkerboard();
  const fs::path folder = scratch_folder(), data = folder / "pairs", file = folder / "calibration.yaml";

  /// Pictures of the first `count` of the `places` in the left eye in which both, as `seen_left` and `seen_right`, see
  /// all of the board's squares.
  void write_pairs(std::size_t count, const std::vector<Transform>& places, const CameraModel& seen_left,
                   const CameraModel& seen_right, const Sight& in_left, const Sight& in_right) const {
    fs::create_directories(data);
    const auto sees_all = [this](const CameraModel& eye, const Transform& cMt) {
      for (const int column : {-1, target.columns})
        for (const int row : {-1, target.rows}) {
          const auto pixel = eye.project(cMt * (target.spacing * Vector3d(column, row, 0)));
          if (!pixel || !eye.contains(*pixel)) return false;
        }
      return true;
    };
    std::size_t pairs = 0;
    for (const Transform& lMt : places) {
      if (pairs == count || !sees_all(seen_left, lMt) || !sees_all(seen_right, rightMleft * lMt)) continue;
      ++pairs;
      const auto write = [&](const char* side, const CameraModel& eye, const Sight& sight, const Transform& cMt) {
        cv::imwrite((data / fmt::format("{}{:02}.png", side, pairs)).string(),
                    picture_of({eye.width, eye.height}, sight, cMt, checkerboard_print(target)));
      };
      write("left", left, in_left, lMt), write("right", right, in_right, rightMleft * lMt);
    }
    ASSERT_EQ(pairs, count);
  }
  ProgramRun calibrate(const std::vector<std::string>& more) const {
    std::vector<std::string> words{"calibrate", "stereo",      "--data", data.string(), "--pattern",
                                   "9x6",       "--square-mm", "30",     "--write",     file.string(),
                                   "--rig",     "tank-sim",    "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return run_tankrig(words);
  }
};

TEST(CalibrationOfARig, HasBothEyesAndHowTheyStandFromPairsOfPictures) {
  const Eyes eyes;
  std::mt19937_64 random(kSeed);
  RecordProperty("seed", std::to_string(kSeed));
  const auto sight_of = [](const CameraModel& eye) { return [&eye](double u, double v) { return eye.sight(u, v); }; };
  eyes.write_pairs(8, many_places(eyes.left, eyes.target, 200, random), eyes.left, eyes.right, sight_of(eyes.left),
                   sight_of(eyes.right));
  const ProgramRun run = eyes.calibrate({"--model", "k1"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Calibration written = read_calibration(eyes.file);
  ASSERT_TRUE(written.camera("left") && written.camera("left")->lens && written.camera("right") && written.stereo);
  EXPECT_NEAR(written.camera("left")->lens->model.fx, eyes.left.fx, 4 * written.camera("left")->lens->sigma[0]);
  EXPECT_EQ(written.camera("left")->lens->sigma.size(), 9u) << "there is no port";
  const Vector3d apart = written.stereo->pose.translation() - eyes.rightMleft.inverse().translation();
  for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(apart[k]), 4 * written.stereo->sigma_m[k]) << k;
  EXPECT_LT(apart.norm(), 1e-3);
}

/// Lines of sight as the simulator traces them through both faces of a port.
Sight traced(const CameraModel& lens, const FlatPort& port) {
  return [&](double u, double v) {
    const sim::PortRay ray = sim::through_port(port, lens.ray(u, v));
    return ViewingRay{ray.origin, ray.direction};
  };
}

TEST(CalibrationOfARig, HasThePortsThatTheSimulatorTracesBothEyesThrough) {
  const Eyes eyes;
  const FlatPort ports[]{{0.045, 0.010, Vector3d(0.03, -0.02, 1).normalized()},
                         {0.040, 0.010, Vector3d(-0.02, 0.01, 1).normalized()}};
  CameraModel left = eyes.left, right = eyes.right;
  left.port = ports[0], right.port = ports[1];
  std::mt19937_64 random(kSeed);
  RecordProperty("seed", std::to_string(kSeed));
  eyes.write_pairs(10, near_and_far(left, eyes.target, 200, random), left, right, traced(eyes.left, ports[0]),
                   traced(eyes.right, ports[1]));
  const fs::path air = eyes.folder / "air", out = eyes.folder / "out";
  fs::create_directories(air);
  write_camera_file(air / "left.yaml", eyes.left, "left");
  write_camera_file(air / "right.yaml", eyes.right, "right");
  const ProgramRun run = eyes.calibrate({"--port-mm", "10", "--in-air", air.string(), "--out", out.string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.json()["left_decision"], HasSubstr("window flat port"));
  EXPECT_TRUE(read_camera_file(out / "left.yaml").port) << "in the one format that has a place for it";
  const Calibration written = read_calibration(eyes.file);
  EXPECT_EQ(run.json()["right_port"]["distance_m"], written.camera("right")->lens->model.port->distance);
  for (const auto& [name, port] : {std::pair("left", ports[0]), {"right", ports[1]}}) {
    const CalibratedLens& lens = *written.camera(name)->lens;
    ASSERT_TRUE(lens.model.port) << name;
    ASSERT_EQ(lens.sigma.size(), 12u);
    const PortParameters found = parameters_of(*lens.model.port), truth = parameters_of(port);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double sigma = lens.sigma[9 + i];
      std::printf("%s, %s: %.5f +- %.5f, in truth %.5f\n", name, kPortParameterNames[i], found[i], sigma, truth[i]);
      EXPECT_GT(sigma, 0);
      EXPECT_LT(std::abs(found[i] - truth[i]), 4 * sigma) << name << ", " << kPortParameterNames[i];
    }
  }
  const Vector3d apart = written.stereo->pose.translation() - eyes.rightMleft.inverse().translation();
  EXPECT_LT(apart.norm(), 1e-3);

  const auto row = [&](const char* of) {
    const auto budget =
        run_tankrig({"budget", "--rig", "tank-sim", "--calibration", eyes.file.string(), "--json"}).json();
    for (const auto& line : budget["lines"])
      if (line["name"] == of) return line;
    return budget["no such line"];
  };
  EXPECT_EQ(row("left: flat port")["measured"], true);
  EXPECT_GT(row("right: flat port")["stereo_mm"], 0);
}

TEST_F(CalibrateTest, RefusesALensInAirThatIsNoneOrOfAnotherSize) {
  const fs::path air = folder_ / "air.yaml";
  const auto refusal = [&](const CameraModel& lens) {
    write_camera_file(air, CameraFileFormat::kTankrig, {{"camera", lens, {}, {}}});
    return calibrate({"--port-mm", "10", "--in-air", air.string()}).err;
  };
  CameraModel lens = camera_;
  lens.port = FlatPort{0.03, 0.01};
  EXPECT_THAT(refusal(lens), HasSubstr("found a camera behind a flat port"));
  lens.port.reset(), lens.width = 640;
  EXPECT_THAT(refusal(lens), HasSubstr("found a camera of 640x240 px, expected 320x240 as the pictures"));
}

/// The paper's box in front of tank-sim's left camera, as clicked.
class ClickedBox : public testing::Test {
 protected:
  ClickedBox() {
    box_.camera = tank_sim().find_camera(CameraRole::kLeft)->model;
    RecordProperty("seed", std::to_string(box_.seed));
    cv::imwrite((folder_ / "dark.png").string(), box_.picture());
    write_camera_file(folder_ / "left.yaml", box_.camera, "left");
    write_corners("camera: left.yaml\n");
  }
  void write_corners(const std::string& camera, bool swapped = false) const {
    std::string text =
        "image: dark.png\n" + camera + "object: " + TANKRIG_SOURCE_DIR + "/etc/objects/black_box.obj\ncorners:\n";
    auto corners = box_.problem().corners;
    if (swapped) std::swap(corners[0].pixel, corners[1].pixel);
    for (const ClickedCorner& c : corners)
      text += fmt::format("  - {{name: '{}', pixel_px: [{:.2f}, {:.2f}]}}\n", c.name, c.pixel.x(), c.pixel.y());
    write_text(folder_ / "corners.yaml", text);
  }
  ProgramRun calibrate(const std::vector<std::string>& more) const {
    std::vector<std::string> words{"calibrate", "object", "--data", folder_.string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_tankrig(words);
  }
  testing_support::DrawnBox box_;
  fs::path folder_ = scratch_folder();
};

TEST_F(ClickedBox, HasAPoseAPictureAndAFileOfBoth) {
  const fs::path picture = folder_ / "pose.png", out = folder_ / "pose.yaml";
  const ProgramRun run = calibrate({"--picture", picture.string(), "--out", out.string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto t = run.json().at("cMo").at("translation_m");
  EXPECT_LT((Vector3d(t[0], t[1], t[2]) - box_.cMo().translation()).norm(), 0.5e-3);
  EXPECT_FALSE(cv::imread(picture.string()).empty());
  EXPECT_TRUE(fs::exists(out));
  const ProgramRun again = calibrate({"--out", out.string()});
  EXPECT_EQ(again.exit_code, 1) << "a result is not overwritten";
}

TEST_F(ClickedBox, StandsInTheRigWhereItsCameraSawIt) {
  write_corners("");
  const fs::path file = folder_ / "calibration.yaml";
  const ProgramRun run = calibrate({"--write", file.string(), "--rig", "tank-sim", "--of", "left"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Calibration written = read_calibration(file);
  ASSERT_TRUE(written.object);
  const Transform bMo = tank_sim().find_camera(CameraRole::kLeft)->bMc * box_.cMo();
  EXPECT_LT((written.object->pose.translation() - bMo.translation()).norm(), 0.5e-3);
}

TEST_F(ClickedBox, IsSeenThroughTheLensOfTheRigsCalibration) {
  write_corners("");
  const auto distance = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"--rig", "tank-sim", "--of", "left", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramRun run = calibrate(words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? run.json().at("cMo").at("translation_m")[2].get<double>() : 0;
  };
  const double truth = box_.cMo().translation().z();
  EXPECT_NEAR(distance({}), truth, 0.5e-3);

  const fs::path file = folder_ / "calibration.yaml";
  ASSERT_EQ(calibrate({"--write", file.string(), "--rig", "tank-sim", "--of", "left"}).exit_code, 0);
  Calibration longer = read_calibration(file);
  CalibratedLens lens;
  static_cast<CalibrationSource&>(lens) = *longer.object;
  lens.model = box_.camera;
  lens.model.fx *= 1.02;
  lens.model.fy *= 1.02;
  lens.sigma.assign(9, 0.1);
  lens.views = 1;
  longer.camera("left").lens = lens;
  write_text(file, calibration_text(longer));
  EXPECT_NEAR(distance({"--calibration", file.string()}), 1.02 * truth, 5e-3);
  EXPECT_EQ(read_whole_file(file), calibration_text(longer)) << "nothing is written";
}

TEST_F(ClickedBox, WithTwoCornersSwappedIsRefusedByTheirNames) {
  write_corners("camera: left.yaml\n", true);
  const ProgramRun run = calibrate({});
  EXPECT_EQ(run.exit_code, 1);
  for (const int k : {0, 1}) EXPECT_THAT(run.err, HasSubstr(box_.problem().corners[static_cast<std::size_t>(k)].name));
}

TEST(CameraFiles, AreConvertedFromAChainAndNeverLoseALens) {
  const fs::path folder = scratch_folder(), chain = folder / "camchain.yaml", one = folder / "one.cameramodel";
  const CameraModel a{320, 240, 265, 280, 165, 123, -0.28, 0.09, 0.001, -0.0007, 0}, b{320, 240, 270, 281, 160, 120};
  write_camera_file(chain, CameraFileFormat::kKalibr, {{"a", a, Transform::Identity(), {}}, {"b", b, {}, {}}});
  const auto convert = [](const fs::path& in, const fs::path& out, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"calibrate", "convert", in.string(), out.string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_tankrig(words);
  };
  const ProgramRun both = convert(chain, one);
  EXPECT_EQ(both.exit_code, 1);
  EXPECT_THAT(both.err, HasSubstr("found 2 cameras (cam0, cam1)"));
  EXPECT_THAT(both.err, HasSubstr("--camera"));
  ASSERT_EQ(convert(chain, one, {"--camera", "cam0"}).exit_code, 0);
  ASSERT_EQ(convert(one, folder / "one.yaml").exit_code, 0);
  const CameraModel back = read_camera_file(folder / "one.yaml");
  EXPECT_EQ(back.fx, a.fx);
  EXPECT_EQ(back.k1, a.k1);
  EXPECT_EQ(back.p2, a.p2);
  const ProgramRun visp = convert(one, folder / "one.xml");
  EXPECT_EQ(visp.exit_code, 1);
  EXPECT_THAT(visp.err, HasSubstr("k2 = 0.09"));
  EXPECT_FALSE(fs::exists(folder / "one.xml"));
}

TEST(CalibrationOfARig, KeepsItsOtherPartsAndRefusesAnotherRig) {
  const fs::path folder = scratch_folder(), file = folder / "calibration.yaml";
  const fs::path data = marker_poses(folder / "marker");
  const auto hand_eye = [&](const std::string& rig) {
    return run_tankrig({"calibrate", "hand-eye", "--data", data.string(), "--rig", rig, "--write", file.string()});
  };
  ASSERT_EQ(hand_eye("tank-sim").exit_code, 0);
  edit(file, {{"bMc:",
               "time: {time_offset_s: 0.02, sigma_s: 0.001, method: told, made_utc: 2026-01-31T12:00:00Z, data: "
               "there, data_sha256: " +
                   std::string(64, 'a') + "}\n    bMc:"}});
  ASSERT_EQ(hand_eye("tank-sim").exit_code, 0);
  const Calibration again = read_calibration(file);
  EXPECT_EQ(again.camera("mono")->time->method, "told");
  const std::string before = read_text(file);
  const ProgramRun other = hand_eye("tank-true");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("rig: found tank-sim, expected a calibration of tank-true"));
  EXPECT_EQ(read_text(file), before);
  const ProgramRun no_rig =
      run_tankrig({"calibrate", "hand-eye", "--data", data.string(), "--write", (folder / "new.yaml").string()});
  EXPECT_THAT(no_rig.err, HasSubstr("--write: expected --rig RIG beside it"));
}

TEST(HandEyePlan, ProposesPosturesThatTurnTheJointsEnough) {
  const ProgramRun run = run_tankrig({"calibrate", "hand-eye", "--plan", "--rig", "tank-sim", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto postures = run.json()["q_rad"];
  EXPECT_EQ(postures.size(), 24u) << "as many as the rig file's `targets` ask for";
  for (const int joint : {kSlew, kElbow, kJawRotate}) {
    std::vector<double> angles;
    for (const auto& q : postures) angles.push_back(q[static_cast<std::size_t>(joint)]);
    const auto [least, most] = std::minmax_element(angles.begin(), angles.end());
    EXPECT_GT(*most - *least, from_degrees(15)) << kJointNames[static_cast<std::size_t>(joint)];
  }
  EXPECT_EQ(run_tankrig({"calibrate", "hand-eye", "--plan"}).exit_code, 1);
  EXPECT_EQ(run_tankrig({"calibrate", "hand-eye", "--rig", "tank-sim"}).exit_code, 2);
}

}  // namespace
}  // namespace tankrig::test
