// Whether a measured row is judged as it should be, and whether every fault is put to the test.
#include "tests/scenarios/verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

namespace tankrig::scenarios {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using D = sim::FaultDevice;
using K = sim::FaultKind;

constexpr Stamp kBegun{1'000'000'000};
constexpr Stamp kDetected = kBegun + 10ms;

/// The interlock opened on wires, and everything went as it must.
Row good_row() {
  Row row;
  row.trial.place = Place::kCan;
  row.trial.fault.device = D::kInterlock;
  row.trial.fault.kind = K::kOff;
  row.trial.must = "interlock open";
  row.outcome.status = "stopped: interlock open in \"sweep pass 0\"";
  row.outcome.has_begun = true;
  row.outcome.begun = kBegun;
  row.outcome.left = {true, true};
  row.outcome.counts = {{"mono.recorded", 8}, {"mono.incomplete", 2}};
  row.outcome.account["mono"] = {10, 0};
  row.outcome.stamp_error = 1ms;
  row.outcome.reaction = Reaction{kDetected, kDetected, kDetected, 0, 0, true};
  row.wire = WireMarks{.off_byte = kDetected + 1ms,
                       .opened = kDetected + 1ms,
                       .rest = kDetected + 2ms,
                       .last_edge = kDetected + 300ms,
                       .cut = kDetected + 470ms,
                       .rested_after = 0ms};
  return row;
}

/// The same with the relay's line pulled: no byte comes, its contact stays closed and nobody knows, the watchdog box takes
/// its supply.
Row unplugged_row() {
  Row row = good_row();
  row.trial.fault.device = D::kLaser;
  row.trial.fault.kind = K::kUnplugged;
  row.wire->off_byte.reset();
  row.wire->opened.reset();
  row.wire->contact_closed = true;
  row.outcome.left.laser_dark = false;
  return row;
}

TEST(Verdict, ARowAsItMustBeIsNotWrong) {
  EXPECT_EQ(broken(good_row()), "");
  EXPECT_EQ(broken(unplugged_row()), "");
}

TEST(Verdict, AScanThatCompletesThoughItsFaultMustStopItIsWrong) {
  Row row = good_row();
  row.outcome.status = "complete";
  row.outcome.reaction.reset();
  EXPECT_THAT(broken(row), HasSubstr("not detected"));
}

TEST(Verdict, AScanThatStopsForAnotherReasonIsWrong) {
  Row row = good_row();
  row.outcome.status = "stopped: heartbeat late";
  EXPECT_THAT(broken(row), HasSubstr("expected \"interlock open\""));
}

TEST(Verdict, AScanThatStopsThoughNothingMayStopItIsWrong) {
  Row row = good_row();
  row.trial.must = "complete";
  EXPECT_THAT(broken(row), HasSubstr("expected \"complete\""));
}

TEST(Verdict, OneOfSeveralEndsIsEnough) {
  Row row = good_row();
  row.trial.must = "complete or interlock open";
  EXPECT_EQ(broken(row), "");
  row.trial.must = "interlock open or arm silent";
  EXPECT_EQ(broken(row), "");
  row.trial.must = "complete or arm silent";
  EXPECT_NE(broken(row), "");
}

TEST(Verdict, AScanThatEndsBeforeItsFaultIsWrong) {
  Row row = good_row();
  row.outcome.has_begun = false;
  EXPECT_THAT(broken(row), HasSubstr("before the fault"));
  row = good_row();
  row.outcome.begun = kDetected + 1ms;
  EXPECT_THAT(broken(row), HasSubstr("before the fault"));
}

TEST(Verdict, ACommandThatComesACycleTooLateIsWrong) {
  Row row = good_row();
  row.outcome.reaction->laser_cycles = 3;
  EXPECT_THAT(broken(row), HasSubstr("laser off commanded 3 cycles"));
  row = good_row();
  row.outcome.reaction->arm_cycles = 2;
  EXPECT_THAT(broken(row), HasSubstr("arm stopped 2 cycles"));
  row = good_row();
  row.outcome.reaction->laser_first = false;
  EXPECT_THAT(broken(row), HasSubstr("before the laser"));
}

TEST(Verdict, AByteAContactOrADemandThatComesTooLateOrNeverIsWrong) {
  for (std::optional<Stamp> WireMarks::*mark : {&WireMarks::off_byte, &WireMarks::opened, &WireMarks::rest}) {
    Row row = good_row();
    (*row.wire).*mark = kDetected + kOnTheWire + 1ms;
    EXPECT_THAT(broken(row), HasSubstr("after detection"));
    (*row.wire).*mark = std::nullopt;
    EXPECT_NE(broken(row), "");
    (*row.wire).*mark = kDetected - 1ms;
    EXPECT_EQ(broken(row), "") << "before detection is early enough";
  }
}

TEST(Verdict, AWatchdogBoxThatOpensTooLateOrWasNeverClosedIsWrong) {
  for (Row row : {good_row(), unplugged_row()}) {
    row.wire->cut = *row.wire->last_edge + kBoxOpens + 1ms;
    EXPECT_THAT(broken(row), HasSubstr("contactors open 201.0 ms after the box's last edge"));
    row.wire->cut.reset();
    EXPECT_THAT(broken(row), HasSubstr("never closed"));
    row.wire->fed = true;
    EXPECT_THAT(broken(row), HasSubstr("the watchdog box is closed"));
  }
}

TEST(Verdict, AClosedContactOrAMovingArmAfterTheScanIsWrong) {
  Row row = good_row();
  row.wire->contact_closed = true;
  EXPECT_THAT(broken(row), HasSubstr("contact is closed"));
  row = good_row();
  row.wire->rested_after.reset();
  EXPECT_THAT(broken(row), HasSubstr("arm moves"));
  row.wire->rested_after = kArmAlone + 1ms;
  EXPECT_THAT(broken(row), HasSubstr("arm moves 501.0 ms after the scan"));
}

TEST(Verdict, AFaultThatIsDetectedTooLateIsWrong) {
  Row row = good_row();
  const Duration longest = longest_detection(row.trial).value();
  const auto detected_after = [&row](Duration time) {
    row.outcome.reaction->detected = kBegun + time;
    row.wire->off_byte = row.wire->opened = row.wire->rest = kBegun + time;
    return broken(row);
  };
  EXPECT_EQ(detected_after(longest), "");
  EXPECT_THAT(detected_after(longest + 1ms), HasSubstr("after it began"));
  EXPECT_THAT(detected_after(30s), HasSubstr("after it began"));
  row.wire->machine_late = kBearable;
  EXPECT_NE(detected_after(longest + 1ms), "") << "no machine widens a bound";
  row.wire.reset();
  EXPECT_NE(detected_after(longest + 1ms), "");
}

TEST(Verdict, AnArmThatIsSaidToBeAtRestButMovesOrRepeatsItsReadingsIsWrong) {
  for (const bool wires : {true, false}) {
    Row row = good_row();
    if (!wires) row.wire.reset();
    row.outcome.moving = 0.1;
    EXPECT_THAT(broken(row), HasSubstr("but moves"));
    row.outcome.left.arm_at_rest = false;
    EXPECT_EQ(broken(row), "") << "nobody said so";
    row = good_row();
    if (!wires) row.wire.reset();
    row.trial.fault.device = D::kArm;
    row.trial.fault.kind = K::kStuck;
    EXPECT_THAT(broken(row), HasSubstr("readings that repeat")) << "whether it rests or not: nobody can know";
  }
}

TEST(Verdict, AReadingOrACountThatIsMissingIsWrong) {
  Row row = good_row();
  row.outcome.lux = "60.000000";
  row.trial.lux = "no answer";
  EXPECT_THAT(broken(row), HasSubstr("lux meter"));
  row.trial.lux.clear();
  row.trial.counted = "mono.lost";
  EXPECT_THAT(broken(row), HasSubstr("mono.lost is 0"));
}

TEST(Verdict, OfALateMachineNoTimeIsJudged) {
  const auto untimely = [](Row row) {
    row.wire->machine_late = kBearable;
    EXPECT_NE(broken(row), "") << "a machine that had the time is no excuse";
    EXPECT_FALSE(too_late(row));
    row.wire->machine_late = kBearable + 1ns;
    EXPECT_TRUE(too_late(row));
    EXPECT_EQ(broken(row), "");
  };
  Row row = good_row();
  row.wire->off_byte = kDetected + kOnTheWire + 1ms;
  untimely(row);
  row = good_row();
  row.outcome.status = "stopped: laser failed: laser relay: read state: timed out in \"sweep pass 0\"";
  untimely(row);
  row.outcome = {};
  row.outcome.status = "not begun: arm: silent";
  untimely(row);
  row = good_row();
  row.wire->rested_after = kArmAlone + 1ms;
  untimely(row);
}

TEST(Verdict, AnOpenAccountIsWrongAndTellsItsLine) {
  Row row = good_row();
  row.outcome.account["mono"] = {11, 1};
  EXPECT_THAT(broken(row), HasSubstr("camera mono: 8 of 11 frames recorded: incomplete 2, unaccounted 1"));
  row.outcome.account["mono"] = {9, -1};
  EXPECT_THAT(broken(row), HasSubstr("counted twice 1"));
  row.outcome.account.clear();
  EXPECT_THAT(broken(row), HasSubstr("no account"));
  row.wire.reset();
  EXPECT_THAT(broken(row), HasSubstr("no account"));
}

TEST(Verdict, AFrameThatIsRecordedWithAWrongStampIsWrong) {
  Row row = good_row();
  row.outcome.stamp_error = kStampError;
  EXPECT_EQ(broken(row), "");
  row.outcome.stamp_error = kStampError + 1ms;
  EXPECT_THAT(broken(row), HasSubstr("stamp is wrong by 21.0 ms"));
  row.outcome.stamp_error.reset();
  EXPECT_THAT(broken(row), HasSubstr("of no recorded frame"));
  row.wire.reset();
  EXPECT_EQ(broken(row), "") << "mocks give the truth";
}

TEST(Verdict, WhatIsLeftOnOrSaidToBeSafeOrRecordedIsJudgedOnEveryMachine) {
  const auto unsafe = [](const std::function<void(Row&)>& spoil) {
    Row row = good_row();
    row.wire->machine_late = 1h;
    EXPECT_EQ(broken(row), "");
    spoil(row);
    EXPECT_NE(broken(row), "");
  };
  unsafe([](Row& row) { row.wire->contact_closed = true; });
  unsafe([](Row& row) { row.wire->fed = true; });
  unsafe([](Row& row) { row.wire->rested_after.reset(); });
  unsafe([](Row& row) { row.outcome.beam_left_on = true; });
  unsafe([](Row& row) { row.outcome.moving = 0.1; });
  unsafe([](Row& row) { row.outcome.reaction->laser_first = false; });
  unsafe([](Row& row) { row.outcome.reaction.reset(); });
  unsafe([](Row& row) { row.outcome.account["mono"].unaccounted = 1; });
  unsafe([](Row& row) { row.outcome.stamp_error = kStampError + 1ms; });
}

TEST(Trials, EveryFaultOfEveryDeviceIsTriedOrHasItsReason) {
  for (const Absence& absence : absences())
    EXPECT_NE(absence.reason, "") << sim::to_string(absence.device) << ' ' << sim::to_string(absence.kind) << " on "
                                  << absence.where;
}

TEST(Trials, EveryFaultThatMustStopTheScanMustBeDetectedInItsTime) {
  for (const Trial& trial : trials())
    if (trial.must != "complete") {
      EXPECT_TRUE(longest_detection(trial)) << trial.must;
      EXPECT_LT(longest_detection(trial).value_or(1h), 6s) << trial.must;
    }
}

TEST(Trials, NothingIsTriedThatIsNotOffered) {
  for (const Trial& trial : trials()) {
    const auto device = trial.fault.device;
    const bool host = device == sim::FaultDevice::kDisk || device == sim::FaultDevice::kSupervisor;  // on no wire
    const bool mock = host || trial.place == Place::kMock;
    EXPECT_NO_THROW(sim::FaultPlan{{trial.fault}}.check(mock ? sim::FaultLevel::kMock : sim::FaultLevel::kWire));
  }
}

}  // namespace
}  // namespace tankrig::scenarios
