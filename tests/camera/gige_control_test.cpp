// The emulated GigE Vision camera's control channel, asked byte by byte.
#include "sim_backends/wire/gige_control.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/camera/gige_rig.hpp"

namespace tankrig::testing {
namespace {

using Bytes = std::vector<std::uint8_t>;
using sim::GigeControl;
using sim::GigeRegisters;

constexpr std::uint16_t kReadRegister = 0x0080, kWriteRegister = 0x0082, kReadMemory = 0x0084, kWriteMemory = 0x0086;
constexpr std::uint16_t kDone = 0, kInvalidAddress = 0x8003, kAccessDenied = 0x8006;
constexpr std::uint32_t kPrivilege = 0x0A00, kHeartbeat = 0x0938, kTrigger = 0x030C, kExposure = 0x0120;

void put(Bytes& to, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) to.push_back(static_cast<std::uint8_t>(value >> shift));
}

struct Answer {
  int status = -1;  ///< -1: there was none
  Bytes data;
};

/// A client with a socket of its own.
class Client {
 public:
  Client() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(3956);
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  }
  ~Client() { ::close(fd_); }

  Answer ask(std::uint16_t command, const Bytes& arguments, std::uint16_t id) const {
    Bytes packet{0x42, 1};
    put(packet, command, 2);
    put(packet, static_cast<std::uint32_t>(arguments.size()), 2);
    put(packet, id, 2);
    packet.insert(packet.end(), arguments.begin(), arguments.end());
    send(packet);
    return receive();
  }
  Answer write(std::uint32_t address, std::uint32_t value, std::uint16_t id) const {
    Bytes arguments;
    put(arguments, address, 4);
    put(arguments, value, 4);
    return ask(kWriteRegister, arguments, id);
  }
  Answer read_memory(std::uint32_t address, std::uint32_t count, std::uint16_t id) const {
    Bytes arguments;
    put(arguments, address, 4);
    put(arguments, count, 4);
    return ask(kReadMemory, arguments, id);
  }
  void send(const Bytes& packet) const {
    EXPECT_EQ(::send(fd_, packet.data(), packet.size(), 0), static_cast<ssize_t>(packet.size()));
  }

 private:
  Answer receive() const {
    pollfd event{fd_, POLLIN, 0};
    if (::poll(&event, 1, 10'000) <= 0) return {};
    Bytes packet(2048);
    const ssize_t size = ::recv(fd_, packet.data(), packet.size(), 0);
    if (size < 8) return {};
    return {packet[0] << 8 | packet[1], Bytes(packet.begin() + 8, packet.begin() + size)};
  }

  int fd_;
};

class GigeControlTest : public GigeTest {
 protected:
  void SetUp() override {
    GigeTest::SetUp();
    if (IsSkipped()) return;
    sut = std::make_unique<GigeControl>("127.0.0.1", registers, [this](std::uint32_t address, std::uint32_t, Stamp) {
      if (address == kTrigger) ++triggers;
    });
    ASSERT_TRUE(sut->serving());
  }

  GigeRegisters registers{"TEST"};
  std::atomic<int> triggers{0};
  std::unique_ptr<GigeControl> sut;
};

TEST_F(GigeControlTest, CarriesACommandThatIsRepeatedOutOnce) {
  const Client client;
  EXPECT_EQ(client.write(kTrigger, 1, 7).status, kDone);
  EXPECT_EQ(client.write(kTrigger, 1, 7).status, kDone) << "its answer was lost on the way";
  EXPECT_EQ(triggers, 1);
  EXPECT_EQ(client.write(kTrigger, 1, 8).status, kDone);
  EXPECT_EQ(triggers, 2);
}

TEST_F(GigeControlTest, LetsOnlyItsControllerWriteUntilThatIsNotHeardForItsHeartbeat) {
  const Client first, second;
  EXPECT_EQ(first.write(kPrivilege, 2, 1).status, kDone);
  EXPECT_EQ(second.write(kExposure, 5, 1).status, kAccessDenied);
  EXPECT_EQ(second.ask(kWriteMemory, {0, 0, 1, 0x20, 0, 0, 0, 5}, 2).status, kAccessDenied);
  EXPECT_NE(registers.get(kExposure), 5u);
  EXPECT_EQ(first.write(kExposure, 6, 2).status, kDone);
  EXPECT_EQ(registers.get(kExposure), 6u);
  EXPECT_EQ(first.write(kHeartbeat, 20, 3).status, kDone);
  EXPECT_TRUE(wait_for([&, id = std::uint16_t{10}]() mutable {
    return second.write(kExposure, 5, ++id).status == kDone;
  })) << "20 ms without a word of the first";
  EXPECT_EQ(registers.get(kPrivilege), 0u);
}

TEST_F(GigeControlTest, DropsASilentControllerThoughNobodyElseSpeaks) {
  const Client client;
  EXPECT_EQ(client.write(kHeartbeat, 20, 1).status, kDone);
  EXPECT_EQ(client.write(kPrivilege, 2, 2).status, kDone);
  EXPECT_TRUE(wait_for([&] { return registers.get(kPrivilege) == 0; }));
}

TEST_F(GigeControlTest, ReadsRegistersAndTheDescriptionAndNothingBeyondThem) {
  const Client client;
  registers.set(kExposure, 0x01020304);
  EXPECT_EQ(client.ask(kReadRegister, {0, 0, 1, 0x20}, 1).data, (Bytes{1, 2, 3, 4}));
  const Answer description = client.read_memory(0x10000, 8, 2);
  ASSERT_EQ(description.data.size(), 12u);
  EXPECT_EQ(std::string(description.data.begin() + 4, description.data.begin() + 6), "<?") << "XML";
  EXPECT_EQ(client.read_memory(0xFFFFFFF0, 16, 3).status, kInvalidAddress);
  EXPECT_EQ(client.read_memory(0x0FFFF, 8, 4).status, kInvalidAddress) << "across the registers' end";
  EXPECT_EQ(client.read_memory(0, 0xFFFF, 5).status, kInvalidAddress) << "more than a packet holds";
  EXPECT_EQ(client.ask(kReadMemory, {0, 0}, 6).status, kInvalidAddress);
  EXPECT_EQ(client.ask(kWriteMemory, {0, 1, 0, 0, 1, 2, 3, 4}, 7).status, kInvalidAddress) << "of the description";
}

class GigeWholeCameraTest : public GigeTest {};

TEST_F(GigeWholeCameraTest, SendsNothingAtASizeItsSensorDoesNotHave) {
  constexpr std::uint32_t kWidth = 0x0100, kOffsetX = 0x0130, kPixelFormat = 0x0128, kAcquisition = 0x0124;
  sim::GigeCameraSettings settings;
  settings.address = "127.0.0.1";
  settings.width = 64;
  settings.height = 48;
  settings.rate_hz = 200;
  sim::GigeCameraEmulator sut(settings,
                              [](std::uint64_t, Stamp, Duration) { return cv::Mat(48, 64, CV_8UC1, cv::Scalar(7)); });
  const Client client;
  std::uint16_t id = 0;
  const auto write = [&](std::uint32_t address, std::uint32_t value) {
    EXPECT_EQ(client.write(address, value, ++id).status, kDone);
  };
  const auto read = [&](std::uint32_t address) {
    Bytes arguments;
    put(arguments, address, 4);
    const Bytes data = client.ask(kReadRegister, arguments, ++id).data;
    return data.size() == 4 ? std::uint32_t{data[0]} << 24 | data[1] << 16 | data[2] << 8 | data[3] : 0;
  };
  write(kHeartbeat, 600'000);
  write(kPrivilege, 2);
  write(kAcquisition, 1);
  EXPECT_TRUE(wait_for([&] { return sut.sent() > 0; }));
  for (const auto& [address, impossible] :
       {std::pair{kWidth, 0x7FFFFFFFu}, {kWidth, 0u}, {kOffsetX, 0xFFFFFF00u}, {kPixelFormat, 0u}}) {
    const std::uint32_t possible = read(address);
    write(address, impossible);
    const std::uint64_t begun = sut.exposures();
    EXPECT_TRUE(wait_for([&] { return sut.exposures() > begun + 1; }));  // what was being sent is gone
    const std::uint64_t sent = sut.sent();
    EXPECT_TRUE(wait_for([&] { return sut.exposures() > begun + 5; })) << "it goes on exposing";
    EXPECT_EQ(sut.sent(), sent) << "register " << address << " at " << impossible;
    write(address, possible);
    EXPECT_TRUE(wait_for([&] { return sut.sent() > sent; })) << "register " << address << " back at " << possible;
  }
}

TEST_F(GigeControlTest, AnswersNoRubbish) {
  const Client client;
  client.send({0x42});
  client.send({0x43, 1, 0, 0x80, 0, 4, 0, 1, 0, 0, 1, 0x20});  // not the key
  client.send({0x42, 1, 0, 0x80, 0, 200, 0, 1, 0, 0});         // shorter than it says
  client.send({0x42, 1, 0, 0x40, 0, 0, 0, 1});                 // a resend
  registers.set(kExposure, 9);
  EXPECT_EQ(client.ask(kReadRegister, {0, 0, 1, 0x20}, 2).data, (Bytes{0, 0, 0, 9})) << "the first answer of all";
}

}  // namespace
}  // namespace tankrig::testing
