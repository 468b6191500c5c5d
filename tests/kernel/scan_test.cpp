// A whole short scan by the program itself: arm on a CAN controller, camera on V4L2, laser relay on a pty, each behind
// its real driver; the pictures were rendered on the host.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "drivers/can/can_log.hpp"
#include "session/reading/session.hpp"
#include "sim_backends/mock/mock_laser.hpp"
#include "sim_backends/wire/arm_emulator.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "sim_backends/wire/v4l2_output.hpp"
#include "tests/kernel/guest.hpp"
#include "tests/kernel/rig/pictures.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::test {
namespace {

constexpr int kDarkFrames = 3;
constexpr int kSweepFrames = 36;  // 0.3 rad at 0.08 rad/s and 10 frames/s are 37

sim::ArmEmulatorParameters arm_parameters() {
  sim::ArmEmulatorParameters parameters;
  parameters.power_up << 0, 0.13, 1.5, 0, 0.1;
  parameters.power_up_ticks.fill(1000);
  parameters.can_bitrate = 1'000'000;
  parameters.watchdog = std::chrono::seconds(3);
  return parameters;
}

/// The rest of the rig in tests/kernel/rig/rig.yaml.
class RestOfTheRig {
 public:
  explicit RestOfTheRig(const std::filesystem::path& runtime)
      : laser_(std::chrono::seconds(1), clock_),
        relay_({.name = runtime / "laser",
                .protocol = {.status_query = 3},
                .watchdog = std::chrono::seconds(5),
                .answer_delay = {}},
               laser_),
        arm_(arm5e(), arm_parameters(), clock_) {
    CanSettings can;
    can.interface = "rigcan1";
    can.bitrate = arm_parameters().can_bitrate;
    can.filters = arm_parameters().can_ids.host_filters();
    arm_.serve(open_can(can, clock_));
    save_arm_zero(runtime / "arm-zero.yaml", sim::zero_as_homed(arm_, arm_parameters()));
    sim::V4l2OutputSettings output;
    output.width = 320;
    output.height = 240;
    output.rate_hz = 10;
    output.format = PixelFormat::kBgr24;
    const auto choice = [this](std::uint64_t index, Stamp begin, Duration exposure) {
      const Stamp mid = begin + exposure / 2;
      return laser_.power_at(mid) > 0.5 ? lit_picture(arm_.truth_at(mid)[kElbow]) : index % kDarkPictures;
    };
    camera_.emplace(output, sim::pictures_of_folder(KERNEL_PICTURES, output.width, output.height, choice));
  }

  bool laser_is_off() { return laser_.power_at(clock_.now()) == 0; }
  bool arm_rests() { return arm_.true_velocity_at(clock_.now()).isZero(1e-9); }

 private:
  MonotonicClock clock_;
  sim::MockLaser laser_;
  sim::RelayEmulator relay_;
  sim::ArmEmulator arm_;
  std::optional<sim::V4l2OutputEmulator> camera_;
};

/// Everything the scan left behind that says why.
std::string story(const std::filesystem::path& session) {
  return shell("cat " + (session / "events.csv").string() + "; sed -n '/^counts/,/^calibration_sha/p' " +
               (session / "session.yaml").string());
}

/// The rig with emulated devices, in `folder`.
std::filesystem::path emulated_rig(const TemporaryFolder& folder, const std::string& emulation) {
  const std::filesystem::path here = TANKRIG_SOURCE_DIR "/tests/kernel/rig";
  std::ifstream in(here / "rig.yaml");
  std::string text(std::istreambuf_iterator<char>(in), {});
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("base: ../../..", "base: " TANKRIG_SOURCE_DIR);
  replace("scene: scene.xml", "scene: " + (here / "scene.xml").string());
  return folder.write("rig.yaml", text + "emulation: " + emulation + "\n");
}

void power_up_the_bus() {
  for (const char* port : {"rigcan0", "rigcan1"}) {
    set_link(port, "down");
    set_link(port, "up txqueuelen 1000 type can bitrate 1000000 restart-ms 100");
  }
}

class ScanInTheGuest : public testing::Test {
 protected:
  /// Virtual time runs on while a program's pages come from the host: here nobody's deadline is in it.
  static void SetUpTestSuite() {
    const std::string program = TANKRIG_PROGRAM;
    shell("cat " + program + " $(ldd " + program + " | grep -o '/[^ ]*') >/dev/null");
  }
};

TEST_F(ScanInTheGuest, ScansReconstructsAndScoresTheBox) {
  const TemporaryFolder folder;
  power_up_the_bus();
  RestOfTheRig rest(folder.path());
  ::setenv("TANKRIG_RUNTIME", folder.path().c_str(), 1);
  const auto session = folder.path() / "session", said = folder.path() / "said.json";
  shell(std::string(TANKRIG_PROGRAM) + " scan --rig " + TANKRIG_SOURCE_DIR +
        "/tests/kernel/rig/rig.yaml --yes --waive commission --json --out " + session.string() + " >" + said.string());
  EXPECT_TRUE(rest.laser_is_off());
  EXPECT_TRUE(rest.arm_rests());

  SCOPED_TRACE(story(session));
  const auto result = nlohmann::json::parse(folder.read("said.json"));
  EXPECT_GE(result["frames"], 2 * kDarkFrames + kSweepFrames);
  const auto& laser = result["laser"];
  std::printf("%d frames, mean error %.2f mm, %.1f %% of what can be covered, scan and scores %.0f s\n",
              result["frames"].get<int>(), 1e3 * laser["mean_error_m"].get<double>(),
              100 * laser["coverage_of_ceiling"].get<double>(), result["wall_s"].get<double>());
  EXPECT_LT(laser["mean_error_m"], 0.003);
  EXPECT_GT(laser["coverage_of_ceiling"], 0.6);

  // What passed on the bus, as candump would have logged it: five demands and more to each answer of six frames.
  const CanLog log = read_can_log(session / "can.log");
  EXPECT_EQ(log.cut_bytes, 0u);
  EXPECT_GT(log.entries.size(), 1000u);
  EXPECT_EQ(log.entries.front().interface, "rigcan0");
}

TEST_F(ScanInTheGuest, EmulateServesTheWorldOnAVideoDevice) {
  const TemporaryFolder folder;
  const auto rig = emulated_rig(folder, "{v4l2_outputs: {mono: {device: /dev/video10, pixel_format: BGR24}}}");
  const auto stream = folder.path() / "pictures.bgr";
  shell(std::string(TANKRIG_PROGRAM) + " emulate --rig " + rig.string() +
        " --device cameras -- v4l2-ctl -d /dev/video10 " + "--stream-mmap --stream-count 3 --stream-to " +
        stream.string());
  EXPECT_EQ(std::filesystem::file_size(stream), 3u * 320 * 240 * 3);
  const std::string bytes = folder.read("pictures.bgr");
  EXPECT_NE(std::count(bytes.begin(), bytes.end(), bytes[0]), static_cast<long>(bytes.size()));  // no blank picture
}

TEST_F(ScanInTheGuest, EmulateServesTheArmOnACanController) {
  const TemporaryFolder folder;
  power_up_the_bus();
  const auto rig = emulated_rig(folder, "{arm: {can_interface: rigcan1, homed: true}}");
  const auto said = folder.path() / "said.json";
  shell(std::string(TANKRIG_PROGRAM) + " emulate --rig " + rig.string() +
        " --device arm --device laser -- tankrig arm status --rig " + rig.string() + " --json >" + said.string());
  const auto status = nlohmann::json::parse(folder.read("said.json"));
  EXPECT_EQ(status.at("homed"), true);
  EXPECT_GT(status.at("states"), 5);
}

}  // namespace
}  // namespace tankrig::test
