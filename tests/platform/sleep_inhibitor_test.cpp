// The sleep inhibitor on a message bus of the test's own, where a logind answers as it is told.
#include "rig/platform/sleep_inhibitor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "tests/support/fake_logind.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;
using testing_support::FakeLogind;
using testing_support::kAllInhibitors;

TEST(SleepInhibitor, HoldsSleepLidAndShutdownForAsLongAsItLives) {
  FakeLogind logind;
  {
    const SleepInhibitor sut(logind.address());
    EXPECT_EQ(sut.missing(), "");
    EXPECT_EQ(logind.asked(), kAllInhibitors);
    EXPECT_EQ(logind.held(), std::ssize(kAllInhibitors));
  }
  logind.wait_until_given_back();
}

TEST(SleepInhibitor, TellsWhatLogindRefusesAndHoldsTheRest) {
  FakeLogind logind({"handle-lid-switch"});
  const SleepInhibitor sut(logind.address());
  EXPECT_EQ(sut.missing(), "handle-lid-switch: Permission denied");
  EXPECT_EQ(logind.held(), 2);
}

TEST(SleepInhibitor, TellsThatThereIsNoBus) {
  const TemporaryFolder folder;
  const SleepInhibitor sut("unix:path=" + (folder.path() / "none").string());
  EXPECT_THAT(sut.missing(), HasSubstr("No such file or directory"));
}

TEST(SleepInhibitor, GivesABusUpThatTakesConnectionsAndDoesNotAnswer) {
  const TemporaryFolder folder;
  const std::string path = folder.path() / "bus";
  const int mute = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un name{AF_UNIX, {}};
  path.copy(name.sun_path, sizeof name.sun_path - 1);
  ASSERT_TRUE(::bind(mute, reinterpret_cast<sockaddr*>(&name), sizeof name) == 0 && ::listen(mute, 1) == 0);
  EXPECT_THAT(SleepInhibitor("unix:path=" + path, std::chrono::milliseconds{50}).missing(), HasSubstr("cancelled"));
  ::close(mute);
}

TEST(SuspendFinding, IsGoodWhereSleepIsKeptOffAndUsableWithACureWhereItIsNot) {
  FakeLogind well, refuses({"sleep", "handle-lid-switch"});
  EXPECT_EQ(suspend_finding(well.address()).verdict, Verdict::kGood);
  well.wait_until_given_back();  // it is only tried
  const Finding found = suspend_finding(refuses.address());
  EXPECT_EQ(found.verdict, Verdict::kUsable);
  EXPECT_EQ(found.measured, "not kept off: sleep: Permission denied; handle-lid-switch: Permission denied");
  EXPECT_THAT(found.cure, HasSubstr("systemctl mask"));
  EXPECT_FALSE(found.refused);
}

}  // namespace
}  // namespace tankrig
