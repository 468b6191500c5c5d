// Error frames as linux/can/error.h lays them out.
#include "drivers/can/can_error.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <random>

#include "tests/can/can_support.hpp"

namespace tankrig {
namespace {

using namespace can_test;

CanErrorReport decode(canid_t classes, int at = 0, std::uint8_t value = 0) {
  return decode_error_frame(raw_error(classes, at, value));
}

TEST(CanErrorFrame, ControllerBitsAreFaultConfinementStates) {
  const struct {
    int bits;
    std::optional<CanState> state;
  } kTable[] = {{CAN_ERR_CRTL_ACTIVE, CanState::kErrorActive},
                {CAN_ERR_CRTL_RX_WARNING, CanState::kErrorWarning},
                {CAN_ERR_CRTL_TX_WARNING, CanState::kErrorWarning},
                {CAN_ERR_CRTL_RX_PASSIVE, CanState::kErrorPassive},
                {CAN_ERR_CRTL_TX_PASSIVE, CanState::kErrorPassive},
                {CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_PASSIVE, CanState::kErrorPassive},
                {CAN_ERR_CRTL_UNSPEC, std::nullopt},
                {CAN_ERR_CRTL_RX_OVERFLOW, std::nullopt}};
  for (const auto& row : kTable) {
    EXPECT_EQ(decode(CAN_ERR_CRTL, 1, row.bits).state, row.state) << row.bits;
    EXPECT_EQ(decode(CAN_ERR_LOSTARB, 1, row.bits).state, std::nullopt) << "data[1] belongs to CAN_ERR_CRTL";
  }
}

TEST(CanErrorFrame, CountersTellTheStateWhereTheControllerDoesNot) {
  const struct {
    int transmit, receive;
    CanState state;
  } kTable[] = {{0, 0, CanState::kErrorActive},    {95, 95, CanState::kErrorActive},
                {96, 0, CanState::kErrorWarning},  {0, 127, CanState::kErrorWarning},
                {128, 0, CanState::kErrorPassive}, {3, 255, CanState::kErrorPassive}};
  for (const auto& row : kTable) {
    can_frame f = raw_error(0x200);
    f.data[6] = row.transmit;
    f.data[7] = row.receive;
    const CanErrorReport r = decode_error_frame(f);
    EXPECT_EQ(r.state, row.state) << row.transmit << ' ' << row.receive;
    EXPECT_EQ(r.transmit_errors, row.transmit);
    EXPECT_EQ(r.receive_errors, row.receive);
    f.can_id = CAN_ERR_FLAG | CAN_ERR_LOSTARB;
    EXPECT_FALSE(decode_error_frame(f).state) << "older kernels leave rubbish there without CAN_ERR_CNT";
  }
  can_frame both = raw_error(0x200 | CAN_ERR_CRTL, 1, CAN_ERR_CRTL_TX_WARNING);
  both.data[6] = 130;
  EXPECT_EQ(decode_error_frame(both).state, CanState::kErrorWarning) << "the controller's word counts";
}

TEST(CanErrorFrame, EachClassIsTold) {
  EXPECT_TRUE(decode(CAN_ERR_BUSOFF).bus_off);
  EXPECT_EQ(decode(CAN_ERR_BUSOFF).state, CanState::kBusOff);
  EXPECT_TRUE(decode(CAN_ERR_RESTARTED).restarted);
  EXPECT_EQ(decode(CAN_ERR_RESTARTED).state, CanState::kErrorActive);
  EXPECT_TRUE(decode(CAN_ERR_ACK).no_ack);
  EXPECT_TRUE(decode(CAN_ERR_PROT, 3, CAN_ERR_PROT_LOC_ACK).no_ack) << "as controllers with bus error reports tell it";
  EXPECT_FALSE(decode(CAN_ERR_PROT, 3, CAN_ERR_PROT_LOC_CRC_SEQ).no_ack);
  EXPECT_TRUE(decode(CAN_ERR_PROT).bus_error);
  EXPECT_TRUE(decode(CAN_ERR_BUSERROR).bus_error);
  EXPECT_TRUE(decode(CAN_ERR_TRX).bus_error);
  EXPECT_TRUE(decode(CAN_ERR_LOSTARB).lost_arbitration);
  EXPECT_TRUE(decode(CAN_ERR_TX_TIMEOUT).transmit_timeout);
  EXPECT_TRUE(decode(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_RX_OVERFLOW).receive_overflow);
  EXPECT_TRUE(decode(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_TX_OVERFLOW).transmit_overflow);
}

TEST(CanErrorFrame, OverflowOfARealControllerIsNoState) {
  // As the kernel's sja1000 driver sends it: CRTL and CNT, receive overflow, counters at zero.
  const CanErrorReport r = decode(0x204, 1, CAN_ERR_CRTL_RX_OVERFLOW);
  EXPECT_TRUE(r.receive_overflow);
  EXPECT_EQ(r.state, CanState::kErrorActive) << "its counters say so";
}

TEST(CanErrorFrame, DataFramesAndShortFramesTellNothingTheyDoNotCarry) {
  EXPECT_FALSE(decode_error_frame(raw_frame(CAN_ERR_BUSOFF, {1, 2, 3})).bus_off);
  can_frame cut = raw_error(CAN_ERR_CRTL, 1, CAN_ERR_CRTL_TX_PASSIVE);
  cut.can_dlc = 1;
  EXPECT_FALSE(decode_error_frame(cut).state);
}

TEST(CanErrorFrame, AnyBytesDecodeToAConsistentReport) {
  constexpr unsigned kSeed = 21;
  std::mt19937 random(kSeed);
  std::printf("seed %u\n", kSeed);
  for (int i = 0; i < 200'000; ++i) {
    can_frame f{};
    f.can_id = static_cast<canid_t>(random());
    if (random() % 2) f.can_id = CAN_ERR_FLAG | (1u << random() % 12) | (1u << random() % 12);
    f.can_dlc = static_cast<std::uint8_t>(random() % 2 ? 8 : random());
    for (std::uint8_t& x : f.data) x = static_cast<std::uint8_t>(random());
    const CanErrorReport r = decode_error_frame(f);
    if (!(f.can_id & CAN_ERR_FLAG)) {
      ASSERT_FALSE(r.state || r.bus_off || r.no_ack || r.bus_error || r.receive_overflow || r.transmit_errors);
      continue;
    }
    if (r.state) {
      ASSERT_LE(*r.state, CanState::kBusOff) << "an error frame cannot say that the interface is down";
    }
    ASSERT_EQ(r.bus_off, r.state == CanState::kBusOff);
    if (r.restarted) {
      ASSERT_EQ(r.state, CanState::kErrorActive);
    }
    ASSERT_EQ(r.transmit_errors.has_value(), r.receive_errors.has_value());
  }
}

}  // namespace
}  // namespace tankrig
