// Mid-exposure from every kind of stamp, worked out by hand.
#include "drivers/camera/v4l2_stamp.hpp"

#include <gtest/gtest.h>

#include "drivers/camera/v4l2_sequence.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

constexpr Stamp at_ms(std::int64_t ms) { return {ms * 1'000'000}; }

TEST(V4l2Stamp, EndOfFrameIsReadOutAndHalfAnExposureAfterTheMiddle) {
  const V4l2BufferTimes times{at_ms(1000), true, false, at_ms(990), at_ms(1001)};
  const MidExposure mid = mid_exposure(times, {10ms, 4ms, false, 40ms, 500us});
  EXPECT_EQ(mid.stamp, at_ms(1000 - 4 - 5));
  EXPECT_EQ(mid.sigma, Duration{500us});
  EXPECT_EQ(mid.exposure, Duration{10ms});
}

TEST(V4l2Stamp, StartOfExposureIsHalfAnExposureBeforeTheMiddle) {
  const V4l2BufferTimes times{at_ms(1000), true, true, at_ms(990), at_ms(1001)};
  EXPECT_EQ(mid_exposure(times, {10ms, 4ms, false, 40ms, 500us}).stamp, at_ms(1005));
}

TEST(V4l2Stamp, ARollingShutterStampsItsMiddleRow) {
  V4l2BufferTimes times{at_ms(1000), true, false, at_ms(990), at_ms(1001)};
  EXPECT_EQ(mid_exposure(times, {10ms, 30ms, true, 40ms, 500us}).stamp, at_ms(1000 - 15 - 5));
  times.at_start = true;
  EXPECT_EQ(mid_exposure(times, {10ms, 30ms, true, 40ms, 500us}).stamp, at_ms(1000 + 15 + 5));
}

TEST(V4l2Stamp, WithoutAClockTheMiddleOfTheArrivalIntervalStands) {
  // Arrived within (988, 1000]; uniform over 12 ms: sd 3.464 ms.
  const V4l2BufferTimes times{at_ms(5), false, true, at_ms(988), at_ms(1000)};
  const MidExposure mid = mid_exposure(times, {10ms, 4ms, false, 40ms, Duration{0}});
  EXPECT_EQ(mid.stamp, at_ms(994 - 4 - 5)) << "at the end of the frame, whatever the driver says of its stamp";
  EXPECT_NEAR(seconds(mid.sigma), 0.003464, 1e-6);
}

TEST(V4l2Stamp, AnUnknownExposureIsHalfThePeriodAndSigmaSaysSo) {
  // Half an exposure is uniform over 0..20 ms: mean 10 ms, sd 5.774 ms.
  const V4l2BufferTimes times{at_ms(1000), true, false, at_ms(990), at_ms(1001)};
  const MidExposure mid = mid_exposure(times, {std::nullopt, Duration{0}, false, 40ms, Duration{0}});
  EXPECT_EQ(mid.stamp, at_ms(990));
  EXPECT_NEAR(seconds(mid.sigma), 0.005774, 1e-6);
  EXPECT_EQ(mid.exposure, Duration{0});
}

TEST(V4l2Stamp, FieldsAreHalfAFramePeriodApart) {
  const MidExposure buffer{at_ms(1000), 500us, 10ms};
  EXPECT_EQ(field_mid_exposure(buffer, true, false, 40ms).stamp, at_ms(980)) << "stamped at the newer field's end";
  EXPECT_EQ(field_mid_exposure(buffer, false, false, 40ms).stamp, at_ms(1000));
  EXPECT_EQ(field_mid_exposure(buffer, true, true, 40ms).stamp, at_ms(1000)) << "stamped at the older field's start";
  EXPECT_EQ(field_mid_exposure(buffer, false, true, 40ms).stamp, at_ms(1020));
  const MidExposure woven = woven_mid_exposure(buffer, false, 40ms);
  EXPECT_EQ(woven.stamp, at_ms(990));
  EXPECT_NEAR(seconds(woven.sigma), 0.010012, 1e-6);
}

TEST(V4l2Sequence, GapsAreCountedAcrossTheWrapOf32Bits) {
  V4l2Sequence sut;
  EXPECT_EQ(sut.place(0xfffffffe, at_ms(0), 40ms).missed, 0u);
  EXPECT_EQ(sut.place(0xffffffff, at_ms(40), 40ms).missed, 0u);
  const auto place = sut.place(1, at_ms(120), 40ms);
  EXPECT_EQ(place.missed, 1u);
  EXPECT_EQ(place.number, 3u);
}

TEST(V4l2Sequence, ARestartIsBridgedByTheStamps) {
  V4l2Sequence sut;
  sut.place(500, at_ms(0), 40ms);
  sut.restart();
  const auto place = sut.place(0, at_ms(405), 40ms);
  EXPECT_EQ(place.missed, 9u);
  EXPECT_EQ(place.number, 10u);
  EXPECT_EQ(sut.place(1, at_ms(445), 40ms).missed, 0u);
}

TEST(V4l2Sequence, ACountThatRunsBackwardsIsNoGap) {
  V4l2Sequence sut;
  sut.place(100, at_ms(0), 40ms);
  const auto place = sut.place(3, at_ms(40), 40ms);
  EXPECT_EQ(place.missed, 0u);
  EXPECT_EQ(place.number, 1u);
  EXPECT_EQ(sut.place(5, at_ms(120), 40ms).missed, 1u) << "and the count goes on from there";
}

TEST(V4l2Sequence, ADeviceThatDoesNotCountIsCountedByItsStamps) {
  V4l2Sequence sut;
  sut.place(0, at_ms(0), 40ms);
  EXPECT_EQ(sut.place(0, at_ms(41), 40ms).number, 1u);
  const auto place = sut.place(0, at_ms(160), 40ms);
  EXPECT_EQ(place.missed, 2u);
  EXPECT_EQ(place.number, 4u);
  EXPECT_EQ(sut.place(0, at_ms(400), Duration{0}).missed, 0u) << "no period: nothing to count by";
}

}  // namespace
}  // namespace tankrig
