// Serial drivers on the kernel's own UARTs: two lines wired crosswise, named by
// TANKRIG_SERIAL_LINES=/dev/ttyS1:/dev/ttyS2. The kernel tests' virtual machine has them; elsewhere these tests skip.
#include <gmock/gmock.h>
#include <termios.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <thread>
#include <vector>

#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "drivers/lux/t10a.hpp"
#include "sim_backends/wire/lux_frames.hpp"
#include "tests/serial/wait_until.hpp"
#include "tests/support/bench_right.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

using Bytes = std::vector<std::uint8_t>;

/// The far end of a line: calls `heard` with every byte, sends what it returns.
class FarEnd {
 public:
  FarEnd(const SerialSettings& settings, std::function<Bytes(std::uint8_t)> heard)
      : port_(settings), heard_(std::move(heard)), thread_([this] { run(); }) {}
  ~FarEnd() {
    stop_ = true;
    thread_.join();
  }

 private:
  void run() {
    while (!stop_) {
      std::uint8_t byte = 0;
      if (!port_.wait_readable(20ms).ok() || port_.try_read({&byte, 1}).value() == 0) continue;
      const Bytes answer = heard_(byte);
      for (std::size_t sent = 0; sent < answer.size() && !stop_;)
        sent += port_.try_write(std::span(answer).subspan(sent)).value();
    }
  }

  SerialPort port_;
  std::function<Bytes(std::uint8_t)> heard_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class SerialGuest : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* lines = std::getenv("TANKRIG_SERIAL_LINES");
    if (!lines) GTEST_SKIP() << "needs two serial lines wired crosswise: TANKRIG_SERIAL_LINES=/dev/ttyS1:/dev/ttyS2";
    const std::string both = lines;
    const std::size_t colon = both.find(':');
    ASSERT_NE(colon, std::string::npos) << both;
    near_ = both.substr(0, colon);
    far_ = both.substr(colon + 1);
  }

  std::string near_, far_;
};

void expect_carried(SerialPort& from, SerialPort& to, int values) {
  Bytes all, got;
  for (int i = 0; i < values; ++i) all.push_back(static_cast<std::uint8_t>(i));
  std::size_t sent = 0;
  while (got.size() < all.size()) {
    if (sent < all.size()) sent += from.try_write(std::span(all).subspan(sent)).value();
    ASSERT_TRUE(to.wait_readable(20s).ok()) << "after " << got.size() << " bytes";
    std::array<std::uint8_t, 64> some;
    const auto n = to.try_read(some);
    got.insert(got.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(n.value()));
  }
  EXPECT_EQ(got, all);
}

TEST_F(SerialGuest, CarriesEveryByteAtTheArmsAndTheMetersSettings) {
  const SerialSettings kinds[] = {{"", 115200, 8, 'N', 1}, {"", 9600, 7, 'E', 1}, {"", 9600, 8, 'O', 2}};
  for (SerialSettings settings : kinds) {
    SerialSettings other = settings;
    settings.device = near_;
    other.device = far_;
    SerialPort here(settings), there(other);
    termios set{};
    ASSERT_EQ(::tcgetattr(here.descriptor(), &set), 0);
    EXPECT_EQ(::cfgetospeed(&set), static_cast<speed_t>(settings.baud == 9600 ? B9600 : B115200));
    EXPECT_EQ(set.c_cflag & CSIZE, static_cast<tcflag_t>(settings.data_bits == 7 ? CS7 : CS8));
    EXPECT_EQ((set.c_cflag & PARENB) != 0, settings.parity != 'N');
    EXPECT_EQ((set.c_cflag & PARODD) != 0, settings.parity == 'O');
    EXPECT_EQ((set.c_cflag & CSTOPB) != 0, settings.stop_bits == 2);
    EXPECT_EQ(set.c_cflag & CRTSCTS, 0u);
    const int values = settings.data_bits == 7 ? 128 : 256;
    expect_carried(here, there, values);
    expect_carried(there, here, values);
  }
}

TEST_F(SerialGuest, RefusesARateThatTheUartDoesNotKnow) {
  EXPECT_THAT(message_of<InputError>([&] {
                SerialPort({near_, 4000000, 8, 'N', 1});
              }),
              HasSubstr("does not know 4000000 baud"));
}

TEST_F(SerialGuest, SwitchesTheLaserAndLeavesItOff) {
  std::atomic<int> last{0};
  FarEnd box({far_, 9600, 8, 'N', 1}, [&](std::uint8_t byte) {
    last = byte;
    return Bytes{byte};
  });
  {
    RelayLaser laser({.serial = {near_, 9600, 8, 'N', 1}, .answer_timeout = 5s, .opening_timeout = 60s});
    EXPECT_EQ(last, 2);
    ASSERT_TRUE(BenchRight::light(laser).ok());
    ASSERT_TRUE(wait_until([&] { return laser.state().value().powered; }));
    EXPECT_EQ(last, 1);
  }
  EXPECT_EQ(last, 2);
}

/// Answers as a T-10A that measures 123.4 lux.
std::function<Bytes(std::uint8_t)> t10a() {
  return [question = Bytes()](std::uint8_t byte) mutable -> Bytes {
    if (byte == kT10aStx) question.clear();
    question.push_back(byte);
    const auto command = decode_t10a_short(question);
    if (!command.ok()) return {};
    if (command.value().command == 54) {
      const auto reply = encode_t10a(0, 54, "    ");
      return {reply.begin(), reply.end()};
    }
    const auto reply = sim::encode_t10a_measurement(123.4, {});
    return {reply.begin(), reply.end()};
  };
}

TEST_F(SerialGuest, ReadsTheT10aAtSevenBitsEvenParity) {
  FarEnd meter({far_, 9600, 7, 'E', 1}, t10a());
  T10a sut({.device = near_, .reply_timeout = 20s});
  const auto reading = sut.read(60s);
  ASSERT_TRUE(reading.ok()) << reading.error().where;
  EXPECT_DOUBLE_EQ(reading.value().lux, 123.4);
}

}  // namespace
}  // namespace tankrig
