#include "drivers/lux/t10a.hpp"

#include <gmock/gmock.h>

#include <cctype>
#include <random>
#include <string>
#include <vector>

#include "sim_backends/wire/lux_emulator.hpp"

namespace tankrig {
namespace {

using ::testing::HasSubstr;

std::string text(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

std::vector<std::uint8_t> bytes_of(const std::string& s) { return {s.begin(), s.end()}; }

/// Head, command, status and data between STX and ETX, with the checksum that belongs to them.
std::vector<std::uint8_t> framed(const std::string& content) {
  std::uint8_t bcc = 0;
  for (const char c : content + "\x03") bcc = static_cast<std::uint8_t>(bcc ^ static_cast<std::uint8_t>(c));
  char hex[3];
  std::snprintf(hex, sizeof hex, "%02X", bcc);
  return bytes_of("\x02" + content + "\x03" + hex + "\r\n");
}

/// Running, normal, range 2, battery good; the reference is not set.
const std::string kStatus = "0 20";
std::vector<std::uint8_t> reply(const std::string& value, const std::string& status = kStatus) {
  return framed("0010" + status + value + std::string(12, ' '));
}

TEST(T10aProtocol, SendsThePublishedCommands) {
  // ErgoLux ClassT10.cs and luxmeters-py: STX 00541___ ETX 13 CR LF; 99551__0; 00100200.
  EXPECT_EQ(text(t10a_pc_mode()),
            "\x02"
            "00541   "
            "\x03"
            "13\r\n");
  EXPECT_EQ(text(t10a_read(0, false)),
            "\x02"
            "00100200"
            "\x03"
            "00\r\n");
  EXPECT_EQ(text(t10a_read(0, true)),
            "\x02"
            "00100300"
            "\x03"
            "01\r\n");
  EXPECT_EQ(text(t10a_read(29, false)),
            "\x02"
            "29100200"
            "\x03"
            "0B\r\n");
  EXPECT_EQ(text(encode_t10a(99, 55, "1  0")),
            "\x02"
            "99551  0"
            "\x03"
            "02\r\n");
}

TEST(T10aProtocol, DecodesEveryFieldOfAMeasurement) {
  const auto m =
      decode_t10a_measurement(framed("071010+1230 31+12344-0005 "
                                     "2"
                                     "+09870"));
  EXPECT_FALSE(m.ok()) << "31 characters";
  const auto good =
      decode_t10a_measurement(framed("07101 31"
                                     "+12344"
                                     "-00512"
                                     "+09873"));
  ASSERT_TRUE(good.ok()) << good.error().where;
  EXPECT_EQ(good.value().head, 7);
  EXPECT_TRUE(good.value().status.hold);
  EXPECT_EQ(good.value().status.error, ' ');
  EXPECT_EQ(good.value().status.range, 3);
  EXPECT_TRUE(good.value().status.low_battery);
  EXPECT_DOUBLE_EQ(*good.value().value, 1234);
  EXPECT_DOUBLE_EQ(*good.value().delta, -0.51);
  EXPECT_DOUBLE_EQ(*good.value().percent, 98.7);
}

TEST(T10aProtocol, TheLastDigitIsThePowerOfTen) {
  const double powers[] = {1e-4, 1e-3, 1e-2, 1e-1, 1, 1e1, 1e2, 1e3, 1e4, 1e5};
  for (int e = 0; e < 10; ++e)
    EXPECT_DOUBLE_EQ(*decode_t10a_measurement(reply("+1234" + std::to_string(e))).value().value, 1234 * powers[e]);
  EXPECT_DOUBLE_EQ(*decode_t10a_measurement(reply("-00014")).value().value, -1);
  EXPECT_DOUBLE_EQ(*decode_t10a_measurement(reply("+  124")).value().value, 12);
  EXPECT_DOUBLE_EQ(*decode_t10a_measurement(reply("=00004")).value().value, 0);
  EXPECT_EQ(decode_t10a_measurement(reply("      ")).value().value, std::nullopt);
}

TEST(T10aProtocol, KnowsEveryStatus) {
  for (const char hold : std::string("01234567"))
    EXPECT_EQ(decode_t10a_measurement(reply("+00014", std::string(1, hold) + " 20")).value().status.hold,
              (hold - '0') % 2 == 1);
  for (const char error : std::string(" 12357"))
    EXPECT_EQ(decode_t10a_measurement(reply("+00014", std::string("0") + error + "20")).value().status.error, error);
  for (const char battery : std::string("0123"))
    EXPECT_EQ(decode_t10a_measurement(reply("+00014", std::string("0 2") + battery)).value().status.low_battery,
              (battery - '0') % 2 == 1);
}

TEST(T10aProtocol, AcceptsAChecksumInSmallLetters) {
  auto bytes = framed("29100200");
  ASSERT_EQ(bytes[11], 'B');
  bytes[11] = 'b';
  EXPECT_TRUE(decode_t10a_short(bytes).ok());
}

TEST(T10aProtocol, SaysWhatIsWrongWithAReply) {
  const auto fault = [](const std::vector<std::uint8_t>& bytes) {
    const auto m = decode_t10a_measurement(bytes);
    return m.ok() ? std::string("decoded") : std::string(m.error().where);
  };
  const auto changed = [](std::size_t position, char c) {
    auto bytes = reply("+12343");
    bytes[position] = static_cast<std::uint8_t>(c);
    return bytes;
  };
  EXPECT_THAT(fault({}), HasSubstr("wrong length"));
  EXPECT_THAT(fault(framed("00541   ")), HasSubstr("wrong length"));
  EXPECT_THAT(fault(changed(0, 'x')), HasSubstr("STX or ETX missing"));
  EXPECT_THAT(fault(changed(27, 'x')), HasSubstr("STX or ETX missing"));
  EXPECT_THAT(fault(changed(31, 'x')), HasSubstr("CR LF missing"));
  EXPECT_THAT(fault(changed(10, '9')), HasSubstr("wrong checksum"));
  EXPECT_THAT(fault(changed(28, 'x')), HasSubstr("wrong checksum"));
  EXPECT_THAT(fault(framed("x010" + kStatus + std::string(18, ' '))), HasSubstr("head or command is no number"));
  EXPECT_THAT(fault(framed("0011" + kStatus + std::string(18, ' '))), HasSubstr("another command"));
  EXPECT_THAT(fault(reply("+00014", "8 20")), HasSubstr("undefined status"));
  EXPECT_THAT(fault(reply("+00014", "0420")), HasSubstr("undefined status"));
  EXPECT_THAT(fault(reply("+00014", "0 60")), HasSubstr("undefined status"));
  EXPECT_THAT(fault(reply("+00014", "0 24")), HasSubstr("undefined status"));
  EXPECT_THAT(fault(reply("x12344")), HasSubstr("no number"));
  EXPECT_THAT(fault(reply("+12x44")), HasSubstr("no number"));
  EXPECT_THAT(fault(reply("+1 244")), HasSubstr("no number"));
  EXPECT_THAT(fault(reply("+1234x")), HasSubstr("no number"));
  EXPECT_THAT(fault(reply("+    4")), HasSubstr("no number"));
}

TEST(T10aProtocol, NoSingleWrongBitGoesUnnoticed) {
  const auto good = reply("+12343");
  ASSERT_TRUE(decode_t10a_measurement(good).ok());
  for (std::size_t byte = 0; byte < good.size(); ++byte) {
    for (int bit = 0; bit < 7; ++bit) {
      auto bad = good;
      bad[byte] = static_cast<std::uint8_t>(bad[byte] ^ (1 << bit));
      const bool other_case =
          byte >= 28 && byte <= 29 && bit == 5 && std::isalpha(good[byte]);  // of a hexadecimal letter
      EXPECT_EQ(decode_t10a_measurement(bad).ok(), other_case) << "byte " << byte << " bit " << bit;
    }
  }
}

TEST(T10aProtocol, WhateverComesDecodesToAPossibleReadingOrNothing) {
  const unsigned seed = 10;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  int decoded = 0;
  for (int i = 0; i < 200000; ++i) {
    std::vector<std::uint8_t> bytes;
    if (i % 4 == 0) {
      bytes.resize(random() % 40);
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    } else if (i % 4 == 1) {
      bytes = reply("+12343");
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    } else {  // a sound frame with odd content
      std::string content = "0010" + kStatus + "+12343+00014      ";
      for (unsigned k = 1 + random() % 2; k > 0; --k)
        content[random() % content.size()] = " +-0123456789=x"[random() % 15];
      bytes = framed(content);
    }
    const auto m = decode_t10a_measurement(bytes);
    [[maybe_unused]] const auto s = decode_t10a_short(bytes);
    if (!m.ok()) {
      ASSERT_EQ(m.error().code, ErrorCode::kProtocol);
      continue;
    }
    ++decoded;
    ASSERT_GE(m.value().head, 0);
    ASSERT_LE(m.value().head, 99);
    ASSERT_LE(m.value().status.range, 5);
    if (m.value().value) {
      ASSERT_LE(std::abs(*m.value().value), 9999e5);
    }
  }
  EXPECT_GT(decoded, 1000);
}

TEST(T10aProtocol, ReadsBackWhatTheEmulatorWrites) {
  for (double lux = 0.02; lux < 299900; lux *= 1.37) {
    const auto m = decode_t10a_measurement(sim::encode_t10a_measurement(lux, {}));
    ASSERT_TRUE(m.ok()) << m.error().where;
    EXPECT_NEAR(*m.value().value, lux, std::max(0.0050001, lux * 2e-3));
    EXPECT_EQ(m.value().status.error, ' ');
  }
  EXPECT_EQ(decode_t10a_measurement(sim::encode_t10a_measurement(400e3, {})).value().status.error, '5');
}

}  // namespace
}  // namespace tankrig
