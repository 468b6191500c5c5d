// A rig with a calibration file: whose values hold, and which files are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "rig/config/rig_config.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kRoot = TANKRIG_SOURCE_DIR;

std::string full_file() { return read_whole_file(kRoot / "tests/fuzz/corpus/calibration/full.yaml"); }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(CalibrationFile, ReadsBackWhatItWrote) {
  const Calibration read = parse_calibration(full_file(), "a.yaml");
  const std::string text = calibration_text(read);
  const Calibration again = parse_calibration(text, "b.yaml");
  EXPECT_EQ(calibration_text(again), text);
  EXPECT_EQ(again.cameras[0].lens->model.fy, 690);
  EXPECT_EQ(again.cameras[0].time->offset, std::chrono::milliseconds(25));
  EXPECT_EQ(again.joints->theta0[2], 1.97);
  EXPECT_EQ(again.laser->ePl.offset, 0.0975);
  EXPECT_EQ(again.verdict, CalibrationVerdict::kAccepted);
  EXPECT_FALSE(again.object);
  EXPECT_FALSE(again.gripper);
}

TEST(CalibrationFile, KeepsWhatIsKnownOfAPort) {
  Calibration written = parse_calibration(full_file(), "a.yaml");
  std::vector<double>& sigma = written.cameras[0].lens->sigma;
  sigma.insert(sigma.end(), {1e-4, 2e-4, 3e-4});
  EXPECT_THAT(message_of<InputError>([&] { parse_calibration(calibration_text(written), "b.yaml"); }),
              HasSubstr("sigma: found 12 numbers, expected 9"));
  written.cameras[0].lens->model.port = FlatPort{0.045, 0.01};
  const Calibration read = parse_calibration(calibration_text(written), "b.yaml");
  EXPECT_EQ(read.cameras[0].lens->model.port->distance, 0.045);
  EXPECT_EQ(read.cameras[0].lens->sigma, sigma);
}

TEST(CalibrationFile, IsRefusedWithLineAndKey) {
  const std::string good = full_file();
  const struct {
    const char *from, *to, *words;
  } bad[] = {
      {"tankrig-calibration 1", "tankrig-calibration 2", ":1: format: found"},
      {"verdict: accepted", "verdict: good", ":6: verdict: found 'good', expected one of: unchecked, accepted"},
      {"value: 0.2", "value: 0.6", "verdict: found accepted beside a check that failed"},
      {"2026-01-31T12:00:00Z", "yesterday", ":4: made_utc: found 'yesterday', expected a time like"},
      {"0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef", "12",
       "rig_sha256: found '12', expected the 64"},
      {"sigma: [0.5, 0.5,", "sigma: [0.5,", "sigma: found 8 numbers, expected 9"},
      {"views: 24", "views: 0", "views: found '0', expected a number from 1"},
      {"rms_m: 0.0003", "rms: 0.0003", "rms_m"},
      {"offset_m: 0.0975", "offset_m: 97.5", "looks like millimetres"},
      {"theta0_rad: [0.01, 0.14, 1.97, 0]", "theta0_rad: [0.01, 0.14, 90, 0]", "theta0_rad: found"},
      {"name: \"mono\"", "name: \"../mono\"", "expected the name of a camera"},
      {"rms_px: 0.2", "rms_px: .nan", "rms_px"},
  };
  for (const auto& [from, to, words] : bad) try {
      parse_calibration(replaced(good, from, to), "cal.yaml");
      ADD_FAILURE() << "accepted " << to;
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), HasSubstr("cal.yaml:")) << to;
      EXPECT_THAT(e.what(), HasSubstr(words));
    }
}

TEST(RigCalibration, TakesThePlaceOfTheNominalValues) {
  const TemporaryFolder folder;
  const auto file = folder.write("cal.yaml", full_file());
  const RigConfig nominal = load_rig(kRoot / "etc/rigs/tank-sim/rig.yaml");
  const RigConfig rig = load_rig(kRoot / "etc/rigs/tank-sim/rig.yaml", "", file);
  ASSERT_TRUE(rig.calibration);
  EXPECT_FALSE(nominal.calibration);
  EXPECT_EQ(rig.calibration->basis, calibration_basis(nominal));
  EXPECT_EQ(rig.cameras[0].model.fx, 630);
  EXPECT_EQ(rig.cameras[0].bMc.translation(), Vector3d(0.7, 0.2, 0.6));
  EXPECT_EQ(rig.cameras[0].time_offset, std::chrono::milliseconds(25));
  EXPECT_EQ(rig.cameras[1].model.fx, nominal.cameras[1].model.fx) << "not calibrated: nominal";
  EXPECT_LT(((rig.cameras[1].bMc.inverse() * rig.cameras[2].bMc).translation() - Vector3d(0.09, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(rig.arm.dh[1].theta0, 0.14);
  EXPECT_EQ(rig.laser.ePl.offset, 0.0975);
  EXPECT_LT(std::abs(rig.laser.ePl.distance(rig.laser.origin_e)), 1e-12);
  EXPECT_EQ(rig.object.bMo.matrix(), nominal.object.bMo.matrix());

  // A session's copy has the values and names no file: reading it again changes nothing.
  const auto kept = folder.write("kept/rig.yaml", resolved_rig_yaml(rig, "box.obj"));
  const RigConfig again = load_rig(kept);
  EXPECT_FALSE(again.calibration);
  EXPECT_EQ(again.cameras[0].model.fx, 630);
  EXPECT_EQ(again.arm.dh[1].theta0, 0.14);
}

TEST(RigCalibration, IsNamedByTheRigFile) {
  const TemporaryFolder folder;
  folder.write("cal/calibration.yaml", full_file());
  const std::string base = (kRoot / "etc/rigs/tank-sim/rig.yaml").string();
  const auto file =
      folder.write("mine/rig.yaml", "base: " + base + "\nname: mine\ncalibration: ../cal/calibration.yaml\n");
  const RigConfig rig = load_rig(file);
  ASSERT_TRUE(rig.calibration);
  EXPECT_EQ(rig.calibration->file, folder.path() / "cal/calibration.yaml");
  EXPECT_EQ(rig.cameras[0].model.fx, 630);
}

TEST(RigCalibration, OfAnotherRigIsRefused) {
  const TemporaryFolder folder;
  const std::string good = full_file();
  const std::pair<std::string, std::string> bad[] = {
      {replaced(good, "name: \"mono\"", "name: \"aft\""), "cameras: found 'aft', expected a camera of tank-sim"},
      {replaced(good, "width_px: 720", "width_px: 640"), "cameras: 'mono' is 640x576 px, expected the 720x576"},
      {replaced(good, "normal: [1, 0, 0]", "normal: [0, 0, 1]"), "laser.ePl: found a sheet across"},
  };
  for (const auto& [text, words] : bad) try {
      load_rig(kRoot / "etc/rigs/tank-sim/rig.yaml", "", folder.write("cal.yaml", text));
      ADD_FAILURE() << "accepted: " << words;
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), HasSubstr(words));
    }
}

TEST(RigConfig, ChainsBasesToThree) {
  const TemporaryFolder folder;
  const std::string base = (kRoot / "etc/rigs/tank-sim/rig.yaml").string();
  folder.write("1.yaml", "base: " + base + "\nname: one\ndescription: of one\n");
  folder.write("2.yaml", "base: 1.yaml\nname: two\n");
  const RigConfig rig = load_rig(folder.write("3.yaml", "base: 2.yaml\n"));
  EXPECT_EQ(rig.name, "two");
  EXPECT_EQ(rig.description, "of one");
  try {
    load_rig(folder.write("4.yaml", "base: 3.yaml\n"));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("base: found a fourth base"));
  }
}

}  // namespace
}  // namespace tankrig
