// Opening a bus: what the rig file says, and what the user reads when it fails.
#include "drivers/can/open_can.hpp"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/input_error.hpp"
#include "tests/can/can_support.hpp"

namespace tankrig {
namespace {

using namespace can_test;

std::string opening(const std::string& interface) {
  static MonotonicClock clock;
  CanSettings s;
  s.interface = interface;
  return message_of<InputError>([&] { open_can(s, clock); });
}

CanSettings settings_from(const std::string& yaml) {
  const TemporaryFolder folder;
  const ConfigNode node = ConfigNode::load(folder.write("rig.yaml", yaml));
  CanSettings s = can_settings_from(node, "/run/tank");
  node.finish();
  return s;
}

TEST(OpenCan, SettingsComeFromTheRigFile) {
  CanSettings s = settings_from("interface: can1\nbitrate_bit_s: 250000\n");
  EXPECT_EQ(s.interface, "can1");
  EXPECT_EQ(s.bitrate, 250'000);
  s = settings_from("interface: unix:runtime/can0.sock\nreopen_period_s: 0.25\nreceive_buffer_bytes: 65536\n");
  EXPECT_EQ(s.interface, "unix:/run/tank/can0.sock");
  EXPECT_EQ(s.bitrate, 500'000);
  EXPECT_EQ(s.reopen_period, std::chrono::milliseconds(250));
  EXPECT_EQ(s.receive_buffer_bytes, 65536);
  EXPECT_EQ(settings_from("interface: unix:/tmp/x\n").interface, "unix:/tmp/x");
}

TEST(OpenCan, SettingsOutOfRangeAreRefused) {
  for (const char* yaml :
       {"interface: can0\nbitrate_bit_s: 2000000\n", "interface: can0\nbitrate_bit_s: 0\n",
        "interface: can0\nreopen_period_s: 0\n", "bitrate_bit_s: 500000\n", "interface: can0\nspeed: 3\n"})
    EXPECT_NE(message_of<InputError>([&] { settings_from(yaml); }).find("rig.yaml:"), std::string::npos) << yaml;
}

TEST(OpenCan, MissingHubSaysWhatToStart) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "can0.sock").string();
  EXPECT_EQ(opening("unix:" + path), "unix:" + path + ": no CAN bus there: start its emulator first (tankrig emulate)");
  folder.write("file", "");
  EXPECT_NE(opening("unix:" + (folder.path() / "file").string()).find("start its emulator first"), std::string::npos);
}

TEST(OpenCan, PathThatDoesNotFitIsRefused) {
  EXPECT_NE(opening("unix:/" + std::string(200, 'x')).find("found a path of 201 bytes, expected 1 to 107"),
            std::string::npos);
  EXPECT_NE(opening("unix:").find("found a path of 0 bytes"), std::string::npos);
}

TEST(OpenCan, InterfaceNamesAreChecked) {
  for (const char* name : {"", "a-name-of-20-letters", "/dev/can0"})
    EXPECT_NE(opening(name).find("expected a name such as can0, or unix:PATH"), std::string::npos) << name;
}

TEST(OpenCan, KernelWithoutCanSaysSo) {
  const int fd = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (fd >= 0) {
    ::close(fd);
    GTEST_SKIP() << "this kernel has CAN sockets";
  }
  EXPECT_NE(opening("can0").find("this kernel has no CAN sockets: modprobe can-raw, or use the carrier unix:PATH"),
            std::string::npos);
}

}  // namespace
}  // namespace tankrig
