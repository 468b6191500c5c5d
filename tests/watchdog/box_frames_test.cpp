#include "drivers/watchdog/box_frames.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tankrig {
namespace {

std::vector<BoxMessage> found(const std::vector<std::uint8_t>& bytes) {
  BoxReader reader(kReplyLead);
  std::vector<BoxMessage> all;
  for (const std::uint8_t byte : bytes)
    if (const auto message = reader.take(byte)) all.push_back(*message);
  return all;
}

TEST(BoxFrames, HaveTheCheckSumThatIsPublished) {
  // CRC-8/SMBUS of "123456789", from the catalogue of parametrised CRC algorithms.
  const std::uint8_t digits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(box_check_sum(digits, 9), 0xF4);
}

TEST(BoxFrames, ComeBackAsTheyWereSentWhateverTheyHold) {
  for (int value = 0; value < 256; ++value)
    for (int beat = 0; beat < 256; ++beat) {
      const BoxMessage sent{static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(beat)};
      const BoxFrame frame = encode_box(kReplyLead, sent);
      ASSERT_EQ(found({frame.begin(), frame.end()}), std::vector<BoxMessage>{sent});
    }
}

TEST(BoxFrames, AreFoundBehindNoiseAndHalfFrames) {
  const BoxFrame a = encode_box(kReplyLead, {kBoxEnabled, kReplyLead}), b = encode_box(kReplyLead, {0, 7});
  std::vector<std::uint8_t> bytes{0x00, kReplyLead, kReplyLead};
  bytes.insert(bytes.end(), a.begin(), a.end());
  bytes.insert(bytes.end(), b.begin(), b.begin() + 2);
  bytes.insert(bytes.end(), b.begin(), b.end());
  EXPECT_EQ(found(bytes), (std::vector<BoxMessage>{{kBoxEnabled, kReplyLead}, {0, 7}}));
}

TEST(BoxFrames, WithOneWrongBitAreNone) {
  const BoxFrame good = encode_box(kReplyLead, {kBoxEnabled | kBoxBeatsSeen, 0x33});
  for (int bit = 0; bit < 32; ++bit) {
    BoxFrame bad = good;
    bad[static_cast<std::size_t>(bit / 8)] ^= static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_TRUE(found({bad.begin(), bad.end()}).empty()) << bit;
  }
}

TEST(BoxFrames, OfTheOtherDirectionAreNone) {
  const BoxFrame beat = encode_box(kBeatLead, {0, 1});
  EXPECT_TRUE(found({beat.begin(), beat.end()}).empty());
}

}  // namespace
}  // namespace tankrig
