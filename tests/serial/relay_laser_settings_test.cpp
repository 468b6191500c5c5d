// What the rig file says of the laser's relay and of its emulator.
#include <gmock/gmock.h>

#include "core/input_error.hpp"
#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "sim_backends/wire/relay_emulator.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

TEST(RelayLaserSettings, AreReadFromTheRigFile) {
  TemporaryFolder folder;
  const auto file = folder.write("rig.yaml",
                                 "driver: relay\ndevice: runtime/laser\nbaud: 19200\non_byte: 65\noff_byte: 66\n"
                                 "status_query: 63\nwarm_up_s: 2.5\nrefresh_ms: 100\nquery_period_ms: 40\n"
                                 "answer_timeout_ms: 30\nattempts: 3\ncaller_timeout_ms: 700\nopening_timeout_s: 4\n");
  const ConfigNode node = ConfigNode::load(file);
  EXPECT_EQ(node.text("driver"), "relay");
  const RelayLaserSettings s = relay_laser_settings_from(node, "/run/tankrig");
  node.finish();
  EXPECT_EQ(s.serial.device, "/run/tankrig/laser");
  EXPECT_EQ(s.serial.baud, 19200);
  EXPECT_EQ(s.protocol.on_byte, 65);
  EXPECT_EQ(s.protocol.off_byte, 66);
  EXPECT_EQ(s.protocol.status_query, 63);
  EXPECT_EQ(s.warm_up, 2500ms);
  EXPECT_EQ(s.refresh, 100ms);
  EXPECT_EQ(s.query_period, 40ms);
  EXPECT_EQ(s.answer_timeout, 30ms);
  EXPECT_EQ(s.attempts, 3);
  EXPECT_EQ(s.caller_timeout, 700ms);
  EXPECT_EQ(s.opening_timeout, 4s);
}

TEST(RelayEmulatorSettings, FollowTheDeviceOfTheRigFile) {
  TemporaryFolder folder;
  const ConfigNode rig = ConfigNode::load(folder.write("rig.yaml",
                                                       "laser: {device: runtime/laser, on_byte: 7, status_query: 3}\n"
                                                       "emulation: {watchdog_ms: 400, answer_delay_ms: 2}\n"));
  const ConfigNode emulation = rig.child("emulation");
  const auto s = sim::relay_emulator_settings_from(rig.child("laser"), &emulation, "/run/tankrig");
  rig.finish();
  EXPECT_EQ(s.name, "/run/tankrig/laser");
  EXPECT_EQ(s.protocol.on_byte, 7);
  EXPECT_EQ(s.protocol.off_byte, 2);
  EXPECT_EQ(s.protocol.status_query, 3);
  EXPECT_EQ(s.watchdog, 400ms);
  EXPECT_EQ(s.answer_delay, 2ms);
  EXPECT_EQ(sim::relay_emulator_settings_from(rig.child("laser"), nullptr, "/run").watchdog, 1s);
}

TEST(RelayLaserSettings, RefuseBytesThatCannotBeToldApart) {
  TemporaryFolder folder;
  const auto message = [&](const std::string& text) {
    const ConfigNode node = ConfigNode::load(folder.write("rig.yaml", "device: /dev/ttyACM0\n" + text));
    return message_of<InputError>([&] { relay_laser_settings_from(node, "/run"); });
  };
  EXPECT_THAT(message("on_byte: 2\n"), HasSubstr("off_byte: is the same as on_byte"));
  EXPECT_THAT(message("status_query: 1\n"), HasSubstr("rig.yaml:2: status_query: is the same as on_byte or off_byte"));
  EXPECT_THAT(message("on_byte: 256\n"), HasSubstr("expected a number from 0 to 255"));
}

TEST(RelayLaserSettings, RefuseALaserThatWouldGoOffAfterTheArmIsStopped) {
  TemporaryFolder folder;
  const auto message = [&](const std::string& text, Duration watchdog) {
    const ConfigNode node = ConfigNode::load(folder.write("rig.yaml", "device: /dev/ttyACM0\n" + text));
    return message_of<InputError>(
        [&] { check_goes_off_first(node, relay_laser_settings_from(node, "/run"), watchdog); });
  };
  EXPECT_THAT(message("caller_timeout_ms: 0\n", 500ms), HasSubstr("rig.yaml:2: caller_timeout_ms: "));
  EXPECT_THAT(message("caller_timeout_ms: 500\n", 500ms),
              HasSubstr("rig.yaml:2: caller_timeout_ms: found 500, expected less than the arm's watchdog_ms (500)"));
  EXPECT_THAT(message("", 250ms), HasSubstr("caller_timeout_ms: found 250, expected less than"));
  const ConfigNode usual = ConfigNode::load(folder.write("rig.yaml", "device: /dev/ttyACM0\n"));
  EXPECT_NO_THROW(check_goes_off_first(usual, relay_laser_settings_from(usual, "/run"), Arm5eSettings{}.watchdog));
}

}  // namespace
}  // namespace tankrig
