#include "drivers/arm/serial_frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

namespace tankrig {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Written by hand from the public description (docs/reference/arm5e.md), channels Shoulder, Slew, Elbow, JawRotate, Jaw.
// Slew forward 300, elbow backward 0x010A, which goes out as 0x010B; checksum 2980 = 0xA4 modulo 256.
const Bytes kRequest{0xE7, 0,   0,    0,                                //
                     0,    0,   0,    0,    0x0F, 0xFF, 0x0F, 0xFF, 0,  //
                     0,    3,   0x01, 0x2C, 0x0F, 0xFF, 0x0F, 0xFF, 0,  //
                     0,    4,   0x01, 0x0B, 0x0F, 0xFF, 0x0F, 0xFF, 0,  //
                     0,    0,   0,    0,    0x0F, 0xFF, 0x0F, 0xFF, 0,  //
                     0,    0,   0,    0,    0x0F, 0xFF, 0x00, 0xFF, 0,  //
                     0xA4, 0xE5};

// An answer with both marks as data in the elbow's position; checksum 2333 = 0x1D modulo 256.
const Bytes kAnswer{0xE7, 0x0D, 0x71, 0x05,                             //
                    1,    0x34, 0x12, 0xF4, 0x01, 0,    0x0E, 0,    0,  //
                    1,    0xFF, 0xFF, 0x0C, 0xFE, 0,    0x0E, 0x07, 0,  //
                    1,    0xE7, 0xE5, 0,    0,    0,    0x0E, 0,    0,  //
                    1,    0x00, 0x80, 0,    0,    0,    0x0E, 0,    0,  //
                    1,    0x0A, 0x00, 0,    0,    0xC8, 0x0E, 0,    0,  //
                    0x1D, 0xE5};

// PID at start: position 0,0,0, speed 255,4,0 on every channel; checksum 231 + 5 (1 + 255 + 4) = 1531 = 0xFB.
const Bytes kGains{0xE7, 0,   0, 0,                   //
                   1,    0,   0, 0, 255, 4, 0, 0, 0,  //
                   1,    0,   0, 0, 255, 4, 0, 0, 0,  //
                   1,    0,   0, 0, 255, 4, 0, 0, 0,  //
                   1,    0,   0, 0, 255, 4, 0, 0, 0,  //
                   1,    0,   0, 0, 255, 4, 0, 0, 0,  //
                   0xFB, 0xE5};

Bytes bytes_of(const SerialFrame& frame) { return {frame.begin(), frame.end()}; }

/// Every frame found in `stream`.
std::vector<SerialContent> feed(SerialDecoder& decoder, const Bytes& stream) {
  std::vector<SerialContent> found;
  for (const std::uint8_t byte : stream)
    if (decoder.push(byte)) found.push_back(decoder.content());
  return found;
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

TEST(SerialFrame, IsTheDescribedRequestBitForBit) {
  SerialContent content;
  for (SerialSlot& slot : content.slots) slot = {0, encode(DemandSlot{DemandType::kStop, 0, 0xFFF, 0xFFF})};
  content.slots[kSlew].bytes = encode(DemandSlot{DemandType::kSpeedForward, 300, 0xFFF, 0xFFF});
  content.slots[kElbow].bytes = encode(DemandSlot{DemandType::kSpeedBackward, 0x010A, 0xFFF, 0xFFF});
  content.slots[kJawOpening].bytes = encode(DemandSlot{DemandType::kStop, 0, 0xFFF, 0x0FF});
  EXPECT_EQ(bytes_of(encode(content)), kRequest);
}

TEST(SerialFrame, SendsGainsBitForBit) {
  SerialContent content;
  content.slots.fill({1, encode(PidSlot{{0, 0, 0}, {255, 4, 0}})});
  EXPECT_EQ(bytes_of(encode(content)), kGains);
}

TEST(SerialFrame, ReadsTheDescribedAnswer) {
  SerialDecoder sut;
  const auto found = feed(sut, kAnswer);
  ASSERT_EQ(found.size(), 1U);
  const SerialContent& content = found[0];
  EXPECT_EQ(content.master, (std::array<std::uint8_t, 3>{0x0D, 0x71, 0x05}));
  EXPECT_EQ(decode_sensors(content.slots[kShoulder].bytes), (SensorSlot{0x1234, 500, 0, 14, 0}));
  EXPECT_EQ(decode_sensors(content.slots[kSlew].bytes), (SensorSlot{0xFFFF, 0xFE0C, 0, 14, 7}));
  EXPECT_EQ(decode_sensors(content.slots[kElbow].bytes), (SensorSlot{0xE5E7, 0, 0, 14, 0}));
  EXPECT_EQ(decode_sensors(content.slots[kJawRotate].bytes), (SensorSlot{0x8000, 0, 0, 14, 0}));
  EXPECT_EQ(decode_sensors(content.slots[kJawOpening].bytes), (SensorSlot{0x000A, 0, 0xC8, 14, 0}));
  for (const SerialSlot& slot : content.slots) EXPECT_EQ(slot.kind, 1);
  EXPECT_EQ(bytes_of(encode(content)), kAnswer);
}

TEST(SerialDecoder, FindsAFrameAgainAfterGarbage) {
  SerialDecoder sut;
  const Bytes garbage{0x00, 0xE5, 0xE7, 0x12, 0xE7, 0xE7, 0xE5};
  EXPECT_EQ(feed(sut, joined({garbage, kAnswer, kAnswer})).size(), 2U);
  EXPECT_EQ(sut.counters().frames, 2U);
  EXPECT_EQ(sut.counters().discarded_bytes, garbage.size());
  EXPECT_EQ(sut.counters().resyncs, 1U);
  EXPECT_EQ(sut.counters().checksum_errors, 0U);
}

TEST(SerialDecoder, FindsTheFrameBehindOneThatWasCutOff) {
  for (std::size_t cut = 1; cut < kSerialFrameBytes; ++cut) {
    SerialDecoder sut;
    const Bytes part(kAnswer.begin(), kAnswer.begin() + static_cast<std::ptrdiff_t>(cut));
    const auto found = feed(sut, joined({part, kAnswer, kAnswer}));
    ASSERT_EQ(found.size(), 2U) << "cut at " << cut;
    EXPECT_EQ(sut.counters().discarded_bytes, cut);
    // Data that look like marks may fail a second time.
    EXPECT_GE(sut.counters().length_errors + sut.counters().checksum_errors, 1U) << "cut at " << cut;
    EXPECT_LE(sut.counters().length_errors + sut.counters().checksum_errors, 2U) << "cut at " << cut;
    EXPECT_EQ(sut.counters().resyncs, 1U);
  }
}

TEST(SerialDecoder, RefusesAndCountsAWrongChecksum) {
  SerialDecoder sut;
  Bytes wrong = kAnswer;
  wrong[20] ^= 0x10;
  EXPECT_EQ(feed(sut, joined({wrong, kAnswer})).size(), 1U);
  EXPECT_EQ(sut.counters().checksum_errors, 1U);
  EXPECT_EQ(sut.counters().discarded_bytes, kSerialFrameBytes);
}

TEST(SerialDecoder, SeesEveryChangeOfOneByte) {
  for (std::size_t at = 0; at < kSerialFrameBytes; ++at)
    for (const int flip : {0x01, 0x80, 0xFF}) {
      SerialDecoder sut;
      Bytes wrong = kAnswer;
      wrong[at] = static_cast<std::uint8_t>(wrong[at] ^ flip);
      ASSERT_TRUE(feed(sut, wrong).empty()) << at;
      sut.give_up();
      ASSERT_EQ(feed(sut, kAnswer).size(), 1U) << at;
    }
}

TEST(SerialDecoder, GivesUpAPartOfAFrame) {
  SerialDecoder sut;
  feed(sut, Bytes(kAnswer.begin(), kAnswer.begin() + 30));
  sut.give_up();
  EXPECT_EQ(sut.counters().length_errors, 1U);
  EXPECT_EQ(sut.counters().discarded_bytes, 30U);
  EXPECT_EQ(feed(sut, kAnswer).size(), 1U);
}

/// Random bytes, rich in marks, with good and mutated frames among them: no frame is lost unless garbage could be its
/// begin, no byte unaccounted for, and what is accepted has the right sum.
TEST(SerialDecoder, HoldsItsInvariantsOnRandomInput) {
  constexpr unsigned kSeed = 51;
  std::mt19937 random(kSeed);
  SerialDecoder sut;
  std::uint64_t fed = 0, good = 0, found = 0;
  const auto push = [&](std::uint8_t byte) {
    ++fed;
    if (!sut.push(byte)) return;
    ++found;
    const SerialFrame frame = encode(sut.content());
    EXPECT_EQ(frame[49], serial_checksum(frame));
  };
  for (int i = 0; i < 100'000; ++i) {
    const int what = static_cast<int>(random() % 4);
    if (what == 0) {
      for (unsigned n = random() % 8; n > 0; --n)
        push(random() % 3 == 0 ? kStartOfFrame : static_cast<std::uint8_t>(random()));
      continue;
    }
    Bytes frame = kAnswer;
    for (std::size_t at = 1; at < 49; ++at)
      if (random() % 8 == 0) frame[at] = static_cast<std::uint8_t>(random());
    frame[49] = std::accumulate(frame.begin(), frame.begin() + 49, std::uint8_t{0});
    if (what == 1) {
      frame[random() % frame.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
      if (random() % 3 == 0) frame.resize(random() % frame.size());
    } else {
      ++good;
    }
    for (const std::uint8_t byte : frame) push(byte);
  }
  sut.give_up();
  const SerialDecoderCounters& c = sut.counters();
  EXPECT_EQ(c.frames, found);
  EXPECT_EQ(c.frames * kSerialFrameBytes + c.discarded_bytes, fed) << "seed " << kSeed;
  EXPECT_GE(found, good * 99 / 100) << "seed " << kSeed;  // a false start that sums right swallows one now and then
}

}  // namespace
}  // namespace tankrig
