#include "drivers/serial/serial_port.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <vector>

#include "core/input_error.hpp"
#include "sim_backends/wire/pty.hpp"
#include "tests/serial/wait_until.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using sim::Pty;
using ::testing::ElementsAreArray;
using ::testing::EndsWith;
using ::testing::HasSubstr;

using Bytes = std::vector<std::uint8_t>;

struct Line {
  TemporaryFolder folder;
  Pty pty{folder.path() / "line"};
  SerialSettings settings{.device = pty.name().string()};

  Bytes heard(std::size_t count) {
    Bytes all;
    wait_until([&] {
      std::array<std::uint8_t, 256> some;
      const auto got = pty.try_read(some);
      if (got.ok()) all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(got.value()));
      return all.size() >= count;
    });
    return all;
  }
};

Bytes every_byte() {
  Bytes all;
  for (int i = 0; i < 256; ++i) all.push_back(static_cast<std::uint8_t>(i));
  return all;
}

Bytes read_all(SerialPort& port, std::size_t count) {
  Bytes all;
  while (all.size() < count && port.wait_readable(10s).ok()) {
    std::array<std::uint8_t, 64> some;
    const auto got = port.try_read(some);
    if (!got.ok()) break;
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(got.value()));
  }
  return all;
}

std::size_t open_descriptors() {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) ++count;
  return count;
}

TEST(SerialPort, CarriesEveryByteBothWaysUnchanged) {
  Line line;
  SerialPort port(line.settings);
  ASSERT_EQ(port.try_write(every_byte()).value(), 256u);
  EXPECT_THAT(line.heard(256), ElementsAreArray(every_byte()));
  ASSERT_EQ(line.pty.try_write(every_byte()).value(), 256u);
  EXPECT_THAT(read_all(port, 256), ElementsAreArray(every_byte()));
}

TEST(SerialPort, SetsTheBaudRateOnTheLine) {
  Line line;
  line.settings.baud = 9600;
  SerialPort port(line.settings);
  termios now{};
  ASSERT_EQ(::tcgetattr(port.descriptor(), &now), 0);
  EXPECT_EQ(::cfgetospeed(&now), static_cast<speed_t>(B9600));
  EXPECT_EQ(::cfgetispeed(&now), static_cast<speed_t>(B9600));
  EXPECT_EQ(now.c_lflag & (ICANON | ECHO | ISIG), 0u);
  EXPECT_EQ(now.c_oflag & OPOST, 0u);
  EXPECT_EQ(now.c_iflag & (ICRNL | INLCR | IXON | ISTRIP), 0u);
  EXPECT_EQ(now.c_iflag & (IGNBRK | IGNPAR), 0u) << "a damaged byte must not vanish";
  EXPECT_EQ(now.c_cc[VMIN] + now.c_cc[VTIME], 0) << "an idle line reads as nothing, at once";
  EXPECT_EQ(now.c_cflag & CRTSCTS, 0u);
}

TEST(SerialPort, AnIdleLineIsNoNewsAndNoError) {
  Line line;
  SerialPort port(line.settings);
  std::array<std::uint8_t, 8> some;
  ASSERT_TRUE(port.try_read(some).ok());
  EXPECT_EQ(port.try_read(some).value(), 0u);
  EXPECT_EQ(port.wait_readable(1ms).error().code, ErrorCode::kTimeout);
}

TEST(SerialPort, ForgetsWhatWasReceived) {
  Line line;
  SerialPort port(line.settings);
  ASSERT_TRUE(line.pty.try_write(every_byte()).ok());
  ASSERT_TRUE(port.wait_readable(10s).ok());
  ASSERT_TRUE(port.discard_input().ok());
  std::array<std::uint8_t, 8> some;
  EXPECT_EQ(port.try_read(some).value(), 0u);
}

TEST(SerialPort, TakesFewerBytesWhenNobodyReadsTheOtherEnd) {
  Line line;
  SerialPort port(line.settings);
  const Bytes much(1 << 20, 0x55);
  std::size_t taken = 0;
  for (std::size_t more = 1; more > 0 && taken < much.size(); taken += more) {  // the kernel hands some on meanwhile
    const auto now = port.try_write(much);
    ASSERT_TRUE(now.ok());
    more = now.value();
  }
  EXPECT_GT(taken, 0u);
  EXPECT_LT(taken, much.size());
}

TEST(SerialPort, ASecondOpenOfTheSameLineIsRefusedAndLeavesTheFirstAlone) {
  Line line;
  line.settings.baud = 9600;
  SerialPort port(line.settings);
  SerialSettings other = line.settings;
  other.baud = 115200;
  EXPECT_THAT(message_of<InputError>([&] { SerialPort{other}; }), HasSubstr("is in use by another program"));
  termios now{};
  ASSERT_EQ(::tcgetattr(port.descriptor(), &now), 0);
  EXPECT_EQ(::cfgetospeed(&now), static_cast<speed_t>(B9600));
}

TEST(SerialPort, IsFreeAgainWhenItsHolderDiesOrCloses) {
  Line line;
  { SerialPort port(line.settings); }
  const pid_t child = ::fork();
  if (child == 0) {
    SerialPort port(line.settings);
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(message_of<InputError>([&] { SerialPort{line.settings}; }), "no error");
}

TEST(SerialPort, SaysWhatToDoWhenTheDeviceDoesNotExist) {
  const std::string message = message_of<InputError>([] { SerialPort({.device = "/dev/ttyUSB99"}); });
  EXPECT_THAT(message, HasSubstr("/dev/ttyUSB99 does not exist: plug the adapter in"));
}

/// What `action` says when no privileges help it.
template <class Action>
std::string as_ordinary_user(Action action) {
  int result[2];
  if (::pipe(result) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    const bool ordinary = ::geteuid() != 0 || ::setuid(65534) == 0;
    const std::string text = ordinary ? action() : "cannot become an ordinary user";
    [[maybe_unused]] const ssize_t n = ::write(result[1], text.data(), text.size());
    ::_exit(0);
  }
  ::close(result[1]);
  ::waitpid(child, nullptr, 0);
  std::array<char, 1024> text{};
  const ssize_t n = ::read(result[0], text.data(), text.size());
  ::close(result[0]);
  return {text.data(), static_cast<std::size_t>(std::max<ssize_t>(n, 0))};
}

TEST(SerialPort, SaysWhatToDoWhenItMayNotBeOpened) {
  TemporaryFolder folder;
  const auto file = folder.write("line", "");
  std::filesystem::permissions(file, std::filesystem::perms::none);
  std::filesystem::permissions(folder.path(), std::filesystem::perms::all);
  EXPECT_THAT(as_ordinary_user([&] { return message_of<InputError>([&] { SerialPort({.device = file.string()}); }); }),
              HasSubstr("line may not be opened: add the user to the group dialout"));
}

TEST(SerialPort, AnOrdinaryUserOpensAnEmulatedLineAgainAfterAKill) {
  EXPECT_EQ(as_ordinary_user([] {
              Line line;
              const pid_t child = ::fork();
              if (child == 0) {
                SerialPort port(line.settings);
                ::kill(::getpid(), SIGKILL);
              }
              ::waitpid(child, nullptr, 0);
              return message_of<InputError>([&] { SerialPort{line.settings}; });
            }),
            "no error");
}

TEST(SerialPort, SaysWhenTheDeviceIsNoTerminal) {
  EXPECT_THAT(message_of<InputError>([] { SerialPort({.device = "/dev/null"}); }),
              HasSubstr("/dev/null is not a terminal: expected a serial line"));
}

TEST(SerialPort, RefusesSettingsThatNoLineHas) {
  const auto message = [](SerialSettings settings) {
    settings.device = "/dev/ttyUSB99";
    return message_of<InputError>([&] { SerialPort{settings}; });
  };
  EXPECT_THAT(message({.device = "", .baud = 12345}), HasSubstr("baud is 12345, expected a standard rate"));
  EXPECT_THAT(message({.device = "", .data_bits = 9}), HasSubstr("data bits are 9, expected 5 to 8"));
  EXPECT_THAT(message({.device = "", .parity = 'X'}), HasSubstr("parity is 'X', expected N, E or O"));
  EXPECT_THAT(message({.device = "", .stop_bits = 3}), HasSubstr("stop bits are 3, expected 1 or 2"));
}

TEST(SerialPort, NoticesTheHangUpInEveryCallAndShowsItsDescriptorNoMore) {
  const Bytes byte{1};
  std::array<std::uint8_t, 8> some;
  const std::vector<std::function<ErrorCode(SerialPort&)>> calls{
      [&](SerialPort& p) { return p.try_read(some).error().code; },
      [&](SerialPort& p) { return p.try_write(byte).error().code; },
      [&](SerialPort& p) { return p.discard_input().error().code; },
      [&](SerialPort& p) { return p.wait_readable(10s).error().code; }};
  for (const auto& call : calls) {
    Line line;
    SerialPort port(line.settings);
    line.pty.unplug();
    EXPECT_EQ(call(port), ErrorCode::kDisconnected);
    EXPECT_EQ(port.descriptor(), -1);
    EXPECT_EQ(call(port), ErrorCode::kDisconnected);
  }
}

TEST(SerialPort, OpensAgainWhenTheDeviceIsBack) {
  Line line;
  SerialPort port(line.settings);
  const std::size_t before = open_descriptors();
  for (int i = 0; i < 5; ++i) {
    line.pty.unplug();
    ASSERT_EQ(port.wait_readable(10s).error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(port.reopen().error().code, ErrorCode::kNotReady);
    line.pty.plug();
    ASSERT_TRUE(port.reopen().ok());
    ASSERT_EQ(port.try_write(every_byte()).value(), 256u);
    EXPECT_THAT(line.heard(256), ElementsAreArray(every_byte()));
  }
  EXPECT_EQ(open_descriptors(), before);
}

/// Whoever writes regardless may have looked the number up long before.
TEST(SerialPort, KeepsItsNumberSoThatNoByteFallsIntoAnotherFileWhileItsLineIsAway) {
  Line line;
  SerialPort port(line.settings);
  const int number = port.descriptor();
  line.pty.unplug();
  ASSERT_EQ(port.wait_readable(10s).error().code, ErrorCode::kDisconnected);
  ASSERT_EQ(port.reopen().error().code, ErrorCode::kNotReady);  // the line is closed
  TemporaryFolder folder;
  std::vector<int> others;
  for (int i = 0; i < 100; ++i) {
    others.push_back(::open((folder.path() / std::to_string(i)).c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600));
    ASSERT_GE(others.back(), 0);
    EXPECT_NE(others.back(), number);
  }
  port.write_regardless(every_byte());
  for (const int other : others) {
    EXPECT_EQ(::lseek(other, 0, SEEK_END), 0) << "descriptor " << other;
    ::close(other);
  }
  line.pty.plug();
  ASSERT_TRUE(port.reopen().ok());
  EXPECT_EQ(port.descriptor(), number);
  port.write_regardless(every_byte());
  EXPECT_THAT(line.heard(256), ElementsAreArray(every_byte()));
}

TEST(Pty, ReplacesAStaleLinkAndRemovesItsOwn) {
  TemporaryFolder folder;
  const auto name = folder.path() / "line";
  std::filesystem::create_symlink("/dev/pts/99999", name);
  {
    Pty pty(name);
    EXPECT_NE(std::filesystem::read_symlink(name), "/dev/pts/99999");
  }
  EXPECT_FALSE(std::filesystem::is_symlink(name));
}

TEST(Pty, LeavesANameThatAnotherHasTakenOver) {
  TemporaryFolder folder;
  const auto name = folder.path() / "line";
  auto first = std::make_unique<Pty>(name);
  Pty second(name);
  const auto target = std::filesystem::read_symlink(name);
  first.reset();
  EXPECT_EQ(std::filesystem::read_symlink(name), target);
}

TEST(Pty, DoesNotReplaceAFile) {
  TemporaryFolder folder;
  const auto name = folder.write("line", "mine");
  EXPECT_THAT(message_of<InputError>([&] { Pty{name}; }), HasSubstr("exists and is no link"));
  EXPECT_EQ(folder.read("line"), "mine");
}

}  // namespace
}  // namespace tankrig
