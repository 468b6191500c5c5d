// Rig files: read, refused with file and line, and written back as they were used.
#include "rig/config/rig_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "rig/scan/session_rig.hpp"
#include "tests/config/small_rig.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

std::string changed(std::string text, const std::string& find, const std::string& replace) {
  const std::size_t at = text.find(find);
  EXPECT_NE(at, std::string::npos) << find;
  return text.replace(at, find.size(), replace);
}

TEST(RigConfig, ReadsEverySection) {
  const TemporaryFolder folder;
  const RigConfig rig = load_rig(folder.write("rig.yaml", kSmallRig));
  EXPECT_EQ(rig.name, "small");
  EXPECT_EQ(rig.scene, folder.path() / "scenes/tank.xml");
  EXPECT_EQ(rig.arm.dh[2].a, -0.083);
  EXPECT_EQ(rig.arm.limits[kSlew].lower, -1.5708);
  EXPECT_EQ(rig.arm.actuators[kElbow].sign, -1);
  EXPECT_EQ(rig.arm.actuators[kJawRotate].rad_per_tick, 0.0031415927);
  EXPECT_EQ(rig.motion_limits.angle_margin, 0.01);
  EXPECT_EQ(rig.scan.park[kElbow], 1.9);
  EXPECT_EQ(rig.scan.posture[kShoulder], 0.12);
  EXPECT_EQ(rig.scan.sweep.from, 1.3);
  EXPECT_EQ(rig.scan.sweep.to, 2.1);
  EXPECT_EQ(rig.scan.capture.dark_frames, 8);
  EXPECT_EQ(rig.scan.control.position_gain, 1.5);
  EXPECT_EQ(rig.scan.control.following_error_limit, ScanSettings{}.control.following_error_limit)
      << "what is not said keeps its default";
  EXPECT_EQ(rig.scan.capture.frame_period, 0.08) << "of the camera that records the sweep";
  EXPECT_EQ(rig.scan.capture.laser_warm_up, 2);
  EXPECT_TRUE(rig.scan.capture.read_lux);
  ASSERT_EQ(rig.cameras.size(), 3u);
  EXPECT_EQ(rig.cameras[0].model.fy, 682.78);
  EXPECT_EQ(rig.cameras[1].record, RecordWhen::kDark);
  EXPECT_EQ(rig.find_camera(CameraRole::kRight)->bMc.translation().x(), 0.088);
  EXPECT_EQ(rig.laser.ePl.normal, Vector3d(1, 0, 0)) << "a normal is scaled to length one";
  EXPECT_EQ(rig.object.mesh, folder.path() / "objects/box.obj");
  EXPECT_EQ(rig.obstacles.carried.size(), 1u);
  EXPECT_EQ(rig.cameras[0].body.sizes(), RigCamera().body.sizes()) << "a camera has a body, said or not";
  ASSERT_TRUE(rig.section("reconstruction"));
  EXPECT_EQ(rig.section("reconstruction")->child("laser").number("min_snr"), 5);
  EXPECT_FALSE(rig.section("mock"));
}

TEST(RigConfig, AppliesAPresetToItsScanOnly) {
  const TemporaryFolder folder;
  const auto file = folder.write("rig.yaml", kSmallRig);
  const RigConfig rig = load_rig(file, "fine");
  EXPECT_EQ(rig.scan.sweep.passes, 3);
  EXPECT_EQ(rig.scan.sweep.velocity, 0.0625);
  EXPECT_EQ(rig.scan.sweep.to, 2.1);
  EXPECT_FALSE(rig.scan.capture.read_lux);
  EXPECT_THAT(message_of<InputError>([&] { load_rig(file, "finer"); }),
              HasSubstr("presets: found no 'finer', expected one of: fine"));
}

TEST(RigConfig, AcceptsTheSlowestSweepAndCycleThatStillWork) {
  const TemporaryFolder folder;
  const std::string slow =
      changed(kSmallRig, "to_rad: 2.1, velocity_rad_s: 0.1,", "to_rad: 1.31, velocity_rad_s: 0.06,");
  EXPECT_EQ(
      load_rig(folder.write("rig.yaml", changed(slow, "dark_frames: 8",
                                                "dark_frames: 8\n  cycle_hz: 16\n  safety: {guardian_timeout_s: 0.2}")))
          .scan.cycle_hz,
      16);
}

TEST(RigConfig, ShowsAHugeNameOnOneShortLine) {
  const TemporaryFolder folder;
  const auto error = [&](const char* find, const std::string& replace) {
    return message_of<InputError>([&] { load_rig(folder.write("rig.yaml", changed(kSmallRig, find, replace))); });
  };
  const std::string huge(900, 'x');
  for (const std::string& text : {error("name: left", "name: /" + huge), error("backend: mock", "backend: " + huge),
                                  error("fine:\n", huge + ":\n    " + huge + ": 1\n")})
    EXPECT_LT(text.size(), 400u) << text;
}

TEST(RigConfig, WrittenAsUsedLoadsAgainToTheSame) {
  const TemporaryFolder folder;
  RigConfig rig = load_rig(folder.write("rig.yaml", kSmallRig), "fine");
  rig.scan.capture.dark_frames = 3;
  rig.scan.safety.beam.waived = {"mono", "left"};
  rig.scan.sweep.velocity = 1.0 / 7;
  rig.scan.control.feed_forward_lead = 1.0 / 70;
  rig.scan.control.dead_zone << 0.01, 0.02, 1.0 / 30, 0.04, 0;
  const std::string text = resolved_rig_yaml(rig, "box.obj");
  const RigConfig again = load_rig(folder.write("session/rig.yaml", text));
  EXPECT_EQ(again.scene, rig.scene);
  EXPECT_EQ(again.object.mesh, folder.path() / "session/box.obj");
  EXPECT_EQ(again.scan.sweep.velocity, 1.0 / 7);
  EXPECT_EQ(again.scan.control.feed_forward_lead, 1.0 / 70);
  EXPECT_EQ(again.scan.control.dead_zone, rig.scan.control.dead_zone);
  EXPECT_EQ(again.scan.capture.dark_frames, 3);
  EXPECT_EQ(again.scan.safety.beam.waived, rig.scan.safety.beam.waived);
  EXPECT_EQ(again.scan.sweep.passes, 3);
  EXPECT_EQ(again.preset, "fine");
  EXPECT_EQ(again.cameras[0].model.k1, rig.cameras[0].model.k1);
  EXPECT_EQ(again.section("reconstruction")->child("laser").texts("names"), (std::vector<std::string>{"a", "b: c"}));
  EXPECT_EQ(resolved_rig_yaml(again, "box.obj"), text) << "nothing is lost or invented on the way";
}

TEST(RigConfig, DescribesItselfToASession) {
  const TemporaryFolder folder;
  SessionInfo info;
  describe(load_rig(folder.write("rig.yaml", kSmallRig)), info);
  EXPECT_EQ(info.rig, "small");
  EXPECT_EQ(info.cameras.size(), 3u);
  EXPECT_EQ(info.cameras[2].role, CameraRole::kRight);
  EXPECT_EQ(info.calibration.ePl->offset, 0.09796 / 2 * 2);
  EXPECT_EQ(info.object->mesh, "box.obj");
}

TEST(RigConfig, QuestionsLengthsInMillimetresByKeyAndValue) {
  const std::pair<const char*, const char*> millimetres[] = {
      {"offset_m: 0.09796", "offset_m: 97.96"},
      {"tank_size_m: [2, 2, 1.5]", "tank_size_m: [2000, 2000, 1500]"},
      {"origin_e_m: [-0.09796", "origin_e_m: [-97.96"},
      {"  margin_m: 0.02", "  margin_m: 21"},
      {"bMo: {translation_m: [0.5", "bMo: {translation_m: [500"},
  };
  for (const auto& [metres, changed_to] : millimetres) {
    const TemporaryFolder folder;
    const auto file = folder.write("rig.yaml", changed(kSmallRig, metres, changed_to));
    const std::string error = message_of<InputError>([&] { load_rig(file); });
    EXPECT_THAT(error, HasSubstr("_m: found '")) << changed_to;
    EXPECT_THAT(error, HasSubstr("looks like millimetres, expected metres")) << changed_to;
  }
}

TEST(RigConfig, QuestionsALaserThatItsEndEffectorCannotCarry) {
  const std::pair<const char*, const char*> changes[] = {
      {"offset_m: 0.09796", "ePl: found offset_m 9.796, farther from the end effector than a laser it carries (5 m)"},
      {"origin_e_m: [-0.09796", "origin_e_m: found a point 9.79"},
  };
  const auto error = [](const std::string& text) {
    const TemporaryFolder folder;
    return message_of<InputError>([&] { load_rig(folder.write("rig.yaml", text)); });
  };
  for (const auto& [metres, message] : changes) {
    const std::string found =
        error(changed(kSmallRig, metres, std::string(metres).replace(std::string(metres).find("0.09796"), 7, "9.796")));
    EXPECT_THAT(found, HasSubstr(message));
    EXPECT_THAT(found, HasSubstr("looks like millimetres, expected metres"));
  }
}

struct Damage {
  const char *find, *replace, *message;
};

TEST(RigConfig, NamesFileLineAndKeyOfBadInput) {
  const Damage damages[] = {
      {"name: small", "nome: small", "rig.yaml:1: nome: unknown key, expected one of: base, name, description"},
      {"backend: mock", "backend: real", "rig.yaml:3: backend: found 'real', expected one of: mock, devices"},
      {"scene: scenes/tank.xml\n", "", "scene: found nothing, expected a text"},
      {"  dh:\n    - {a_m: 0.08052, alpha_rad: 1.5707963267948966, d_m: 0, theta0_rad: 0}\n", "  dh:\n",
       "arm.dh: found 3 links, expected 4"},
      {"{a_m: 0.44278,", "{a_m: long,", "rig.yaml:8: arm.dh[1].a_m: found 'long', expected a number"},
      {"{a_m: 0.44278,", "{a_m: 0.44278, b_m: 1,", "rig.yaml:8: arm.dh[1].b_m: unknown key"},
      {"elbow: [0, 2.15294]", "elbow: [0]",
       "rig.yaml:14: arm.limits_rad.elbow: found a list of 1, expected a list of 2 numbers"},
      {"elbow: [0, 2.15294]", "elbow: [3, 2.15294]", "arm.limits_rad.elbow: found a range that is empty"},
      {"elbow: [0, 2.15294]", "wrist: [0, 2.15294]", "arm.limits_rad.elbow: found nothing"},
      {"sign: -1", "sign: 0", "sign: found '0', expected 1 or -1"},
      {"angle_margin_rad: 0.01", "margin: 0.01", "arm.motion_limits.margin: unknown key"},
      {"park_rad: [0, 0.3, 1.9, 0, 0.1]", "park_rad: [0, 0.3, 1.9, 0]",
       "rig.yaml:25: scan.park_rad: found a list of 4, expected a list of 5 numbers"},
      {"park_rad: [0, 0.3, 1.9", "park_rad: [0, 0.3, 2.9",
       "rig.yaml:25: scan.park_rad: found elbow at 2.9 rad, expected 0 to 2.15294 as in arm.limits_rad"},
      {"to_rad: 2.1", "to_rad: 2.2", "scan.sweep.to_rad: found elbow at 2.2 rad"},
      {"to_rad: 2.1", "to_rad: 1.3", "scan.sweep.to_rad: found the same angle as from_rad"},
      {"velocity_rad_s: 0.1,", "velocity_rad_s: -0.1,",
       "scan.sweep.velocity_rad_s: found '-0.1', expected a number from 0.001 to 2"},
      {"velocity_rad_s: 0.1,", "speed: 0.1,", "scan.sweep.velocity_rad_s: found nothing"},
      {"velocity_rad_s: 0.1,", "velocity_rad_s: 0.05,",
       "rig.yaml:27: scan.sweep.velocity_rad_s: found '0.05', expected at least 0.06: below it the arm sticks"},
      {"control: {", "control: {dead_zone_rad_s: [0.1, 0.1, 0.11, 0.1, 0.1], ",
       "scan.sweep.velocity_rad_s: found '0.1', expected at least 0.11: below it the arm sticks"},
      {"velocity_rad_s: 0.0625", "velocity_rad_s: 0.0525",
       "presets.fine.sweep.velocity_rad_s: found '0.0525', expected at least 0.06: below it the arm sticks"},
      {"control: {", "control: {dead_zone_rad_s: [0.1, 0.1, -0.1, 0.1, 0.1], ",
       "scan.control.dead_zone_rad_s: found [0.1, 0.1, -0.1, 0.1, 0.1], expected five numbers from 0 to 2"},
      {"control: {", "control: {dead_zone_rad_s: [0.1], ", "scan.control.dead_zone_rad_s: found a list of 1"},
      {"control: {", "control: {feed_forward_lead_s: -1, ", "scan.control.feed_forward_lead_s: found '-1'"},
      {"to_rad: 2.1, velocity_rad_s: 0.1,", "to_rad: 1.3159, velocity_rad_s: 0.1,",
       "scan.sweep.velocity_rad_s: found '0.1', a sweep of 0.159 s, expected at least two frame periods of 0.08 s"},
      {"dark_frames: 8", "dark_frames: 8\n  cycle_hz: 15.9",
       "scan.cycle_hz: found '15.9', expected at least 16, four cycles in control.feedback_timeout_s"},
      {"dark_frames: 8", "dark_frames: 8\n  safety: {beam: {waived: [mona]}}",
       "scan: safety.beam.waived: found 'mona', expected the name of a camera"},
      {"passes: 1}", "passes: 1.5}", "scan.sweep.passes: found '1.5', expected a whole number"},
      {"dark_frames: 8", "dark_frames: 8\n  laser_pairs: true",
       "scan.laser_pairs: found true, expected false unless laser.switches_per_frame is true"},
      {"passes: 3,", "passes: 0,", "presets.fine.sweep.passes: found '0'"},
      {"read_lux: false", "red_lux: false", "presets.fine.red_lux: unknown key"},
      {"name: left", "name: mono", "name: found 'mono' for the second time"},
      {"name: left", "name: ../left", "name: found '../left', expected a name that can be a folder's"},
      {"role: left", "role: middle", "role: found 'middle', expected one of: mono, left, right"},
      {"role: left", "role: mono", "role: found 'mono' for the second time"},
      {"record: all", "record: dark", "cameras: found no mono camera that records the sweep"},
      {"record: all", "record: often", "record: found 'often', expected one of: all, dark, sweep"},
      {"width_px: 720", "width_px: -720", "cameras[0].model.width_px: found '-720'"},
      {"[0.5, 0.5, 0.5, 0.5]", "[0.5, 0.5, 0.5, 0.9]", "quaternion has norm"},
      {"normal: [2, 0, 0]", "normal: [0, 0, 0]", "laser.ePl.normal: found length 0"},
      {"origin_e_m: [-0.09796", "origin_e_m: [-0.2", "laser.origin_e_m: found a point"},
      {"direction_e: [0, 0, 1]", "direction_e: [1, 0, 1]", "laser.direction_e: found a direction out of the sheet"},
      {"mesh: objects/box.obj\n", "mush: 1\n", "object.mesh: found nothing"},
      {"tank_size_m: [2, 2, 1.5]", "tank_size_m: [2, 2, 0]",
       "obstacles.tank_size_m: found a side that is not positive"},
      {"  margin_m: 0.02", "  margin_m: 0.02\n  margin_m: 0.03", "obstacles.margin_m: stands twice"},
      {"backend: mock", "backend: [mock", "expected valid YAML"},
  };
  for (const Damage& damage : damages) {
    const TemporaryFolder folder;
    const auto file = folder.write("rig.yaml", changed(kSmallRig, damage.find, damage.replace));
    const std::string error = message_of<InputError>([&] { load_rig(file); });
    EXPECT_THAT(error, HasSubstr(damage.message)) << damage.replace;
    EXPECT_EQ(error.find('\n'), std::string::npos) << "one line";
  }
  EXPECT_THAT(message_of<InputError>([] { load_rig("/no/such/rig.yaml"); }),
              HasSubstr("/no/such/rig.yaml: cannot be read"));
}

TEST(RigConfig, HoldsEveryCameraThatRecordsTheSweepByAngleToItsRateAndToEvenLight) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& record, const std::string& scan) {
    std::string text = changed(kSmallRig, "record: dark\n    rate_hz: 25\n  - name: right",
                               "record: " + record + "\n    rate_hz: 25\n    trigger: position\n    spacing_rad: " +
                                   (scan.empty() ? "0.001" : "0.01") + "\n  - name: right");
    text = changed(text, "warm_up_s: 2", "warm_up_s: 2\n  switches_per_frame: true");
    text = changed(text, "dark_frames: 8", "dark_frames: 8" + scan);
    return message_of<InputError>([&] { load_rig(folder.write("rig.yaml", text)); });
  };
  EXPECT_THAT(refusal("sweep", ""), HasSubstr("camera left: spacing_rad: found 0.001, 0.01 s at the sweep's velocity, "
                                              "expected at least a frame's time of 0.04 s"));
  EXPECT_THAT(refusal("all", "\n  laser_pairs: true"),
              HasSubstr("camera left: trigger: found position with scan: laser_pairs"));
  EXPECT_EQ(refusal("dark", ""), "no error") << "dark blocks are triggered at equal times";
}

TEST(RigConfig, TakesFromItsBaseWhatItDoesNotSayItself) {
  const TemporaryFolder folder;
  folder.write("base/rig.yaml", kSmallRig);
  const auto file =
      folder.write("over/rig.yaml", "base: ../base/rig.yaml\nname: wired\nbackend: devices\nlaser:\n  fan_rad: x\n");
  try {
    load_rig(file);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("over/rig.yaml:5: laser.fan_rad: found 'x'"));
  }
  folder.write("over/rig.yaml",
               "base: ../base/rig.yaml\nname: wired\nbackend: devices\ndevices: {arm: {driver: arm5e}}\n");
  const RigConfig rig = load_rig(file, "fine");
  EXPECT_EQ(rig.name, "wired");
  EXPECT_EQ(rig.backend, "devices");
  EXPECT_EQ(rig.scan.sweep.passes, 3);
  EXPECT_EQ(rig.scene, folder.path() / "base/scenes/tank.xml");
  EXPECT_EQ(rig.section("devices")->child("arm").text("driver"), "arm5e");
  const auto kept = folder.write("kept/rig.yaml", resolved_rig_yaml(rig, "box.obj"));
  EXPECT_EQ(load_rig(kept).section("devices")->child("arm").text("driver"), "arm5e");
}

TEST(RigConfig, NamesTheBaseFileForWhatIsWrongThere) {
  const TemporaryFolder folder;
  std::string base = kSmallRig;
  base.replace(base.find("dark_frames: 8"), 14, "dark_frames: x");
  folder.write("base/rig.yaml", base);
  const auto file = folder.write("over/rig.yaml", "base: ../base/rig.yaml\nname: wired\n");
  try {
    load_rig(file);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("base/rig.yaml:"));
    EXPECT_THAT(e.what(), testing::HasSubstr("scan.dark_frames: found 'x'"));
  }
  folder.write("base/rig.yaml", "base: other.yaml\n");
  EXPECT_THROW(load_rig(file), InputError);
}

}  // namespace
}  // namespace tankrig
