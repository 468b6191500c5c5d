// A V4L2 camera's frames and faults, on a scripted device.
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "tests/camera/v4l2_rig.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;

using V4l2Streaming = V4l2Rig;
using V4l2Faults = V4l2Rig;
using V4l2Fields = V4l2Rig;

TEST_F(V4l2Streaming, APictureIsTakenOutOfItsPaddedRowsAndItsBufferGoesBack) {
  script->padding = 5;
  auto camera = started();
  std::vector<std::uint8_t> picture(script->size(), 9);
  picture[script->stride() + 3] = 77;
  EXPECT_FALSE(grab(*camera));
  script->deliver(picture, {});
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->image.size(), cv::Size(8, 4));
  EXPECT_EQ(pixel(*frame, 3, 1), 77);
  EXPECT_EQ(pixel(*frame, 3, 2), 9);
  EXPECT_EQ(script->queued.size(), 4u);
  EXPECT_FALSE(grab(*camera));
  EXPECT_EQ(camera->counters().delivered, 1u);
  EXPECT_EQ(camera->info().width, 8);
  EXPECT_EQ(camera->info().height, 4);
  EXPECT_EQ(camera->info().channels, 1);
}

TEST_F(V4l2Streaming, StampsAreMidExposureOfTheirDeclaredKind) {
  settings.readout = 3ms;
  auto camera = started();
  grab(*camera);
  script->pass(40ms);
  script->deliver(1);
  auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->stamp, script->now - 8ms);
  EXPECT_EQ(frame->stamp_sigma, settings.stamp_sigma);
  EXPECT_EQ(frame->exposure, Duration{10ms});

  script->pass(40ms);
  script->deliver(1, {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE});
  EXPECT_EQ(grab(*camera)->stamp, script->now + 5ms);
  EXPECT_EQ(statistic(*camera, "stamp_at_start"), 1);
  EXPECT_EQ(statistic(*camera, "stamps_monotonic"), 2);
}

TEST_F(V4l2Streaming, StampsOfUnknownOrCopiedClocksGiveWayToTheTimeOfArrivalWithALargerSigma) {
  auto camera = started();
  for (const std::uint32_t kind : {V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, V4L2_BUF_FLAG_TIMESTAMP_COPY}) {
    script->pass(30ms);
    grab(*camera);  // nothing yet
    script->pass(4ms);
    script->deliver(1, {static_cast<std::uint32_t>(kind)});
    script->pass(8ms);
    const auto frame = grab(*camera);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->stamp, script->now - 6ms - 5ms)
        << "the middle of the 12 ms since the last look, less half the exposure";
    EXPECT_NEAR(seconds(frame->stamp_sigma), 0.0035, 1e-5);  // 12 ms / sqrt(12), and 0.5 ms
  }
  EXPECT_EQ(statistic(*camera, "stamps_by_arrival"), 2);
}

TEST_F(V4l2Streaming, TheRigFileMayVouchForAnUndeclaredClock) {
  settings.stamp_clock = StampClock::kMonotonic;
  settings.stamp_point = StampPoint::kStart;
  auto camera = started();
  script->deliver(1, {V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN});
  const Stamp stamped = script->now;
  script->pass(20ms);
  EXPECT_EQ(grab(*camera)->stamp, stamped + 5ms);
}

TEST_F(V4l2Streaming, AStampFarFromNowIsOnNoClockOfOurs) {
  auto camera = started();
  script->deliver(1);
  script->pass(1h);
  grab(*camera);
  EXPECT_EQ(statistic(*camera, "stamps_monotonic"), 0);
  EXPECT_EQ(statistic(*camera, "stamps_by_arrival"), 1);
}

TEST_F(V4l2Streaming, AllFormatsComeThroughTheirConversion) {
  script->offered = {V4L2_PIX_FMT_YUYV};
  settings.channels = 3;
  script->colorspace = V4L2_COLORSPACE_JPEG;
  auto camera = started();
  std::vector<std::uint8_t> picture;
  for (int i = 0; i < 16; ++i) picture.insert(picture.end(), {76, 85, 76, 255});
  script->deliver(picture, {});
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->image.at<cv::Vec3b>(3, 7), cv::Vec3b(0, 0, 254)) << "full range, because the device says so";
}

TEST_F(V4l2Streaming, MotionJpegIsAsLongAsItSays) {
  script->offered = {V4L2_PIX_FMT_MJPEG};
  script->width = 48;
  script->height = 32;
  auto camera = started();
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", cv::Mat(32, 48, CV_8UC1, cv::Scalar(90)), jpeg);
  script->deliver(jpeg, {});
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_NEAR(pixel(*frame, 20, 10), 90, 1);
  script->deliver(jpeg, {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_NONE, 20});
  EXPECT_FALSE(grab(*camera));
  EXPECT_EQ(camera->counters().incomplete, 1u);
  EXPECT_EQ(statistic(*camera, "damaged_pictures"), 1);
}

TEST_F(V4l2Streaming, StoppingGivesEverythingBackAndStartsAgain) {
  auto camera = started();
  EXPECT_EQ(script->mapped, 4);
  camera->stop();
  EXPECT_EQ(script->mapped, 0);
  EXPECT_FALSE(script->streaming);
  EXPECT_FALSE(grab(*camera)) << "stopped: no news, no error";
  EXPECT_TRUE(camera->start().ok());
  EXPECT_TRUE(camera->start().ok()) << "again is no harm";
  EXPECT_EQ(script->streams_on, 2);
  script->deliver(3);
  EXPECT_TRUE(grab(*camera));
  camera.reset();
  EXPECT_EQ(script->mapped, 0);
}

TEST_F(V4l2Streaming, TheNextFrameIsExpectedAPeriodAfterTheLast) {
  auto camera = started();
  script->deliver(1);
  grab(*camera);
  const Stamp then = script->now;
  grab(*camera);
  EXPECT_EQ(camera->next_frame_at(), then + 40ms);
  script->pass(60ms);
  grab(*camera);
  EXPECT_EQ(camera->next_frame_at(), script->now + 1ms) << "late: a waiting thread must not spin";
  camera->stop();
  EXPECT_FALSE(camera->next_frame_at());
}

TEST_F(V4l2Faults, SequenceGapsAreLostFrames) {
  auto camera = started();
  for (const std::uint32_t n : {0u, 1u, 4u, 5u}) {
    script->pass(40ms);
    script->sequence = n;
    script->deliver(1);
    EXPECT_EQ(grab(*camera)->sequence, n);
    grab(*camera);
  }
  EXPECT_EQ(camera->counters().lost, 2u);
  EXPECT_EQ(camera->counters().overrun, 0u);
  EXPECT_EQ(camera->counters().delivered, 4u);
}

TEST_F(V4l2Faults, GapsAfterTheCallerStayedAwayAreOverruns) {
  auto camera = started();
  grab(*camera);
  for (int i = 0; i < 10; ++i) {
    script->pass(40ms);
    script->deliver(1);  // the driver has 4 buffers; 6 pictures find none
  }
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(grab(*camera));
  grab(*camera);
  script->pass(40ms);
  script->deliver(1);
  EXPECT_EQ(grab(*camera)->sequence, 10u);
  EXPECT_EQ(camera->counters().overrun, 6u);
  EXPECT_EQ(camera->counters().lost, 0u);
}

TEST_F(V4l2Faults, GapsOfACallerThatIsTooSlowForTheRateAreOverruns) {
  auto camera = started();
  grab(*camera);
  for (int i = 0; i < 60; ++i) {
    script->pass(40ms);
    script->deliver(1);
    script->pass(40ms);
    script->deliver(1);
    grab(*camera);  // one of two
  }
  EXPECT_GT(camera->counters().overrun, 40u);
  EXPECT_EQ(camera->counters().lost, 0u);
}

TEST_F(V4l2Faults, BuffersWithTheErrorFlagAndShortOnesAreIncomplete) {
  auto camera = started();
  script->deliver(1, {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_ERROR});
  script->deliver(1, {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_NONE, 1});
  script->deliver(1, {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_NONE, 32});
  script->deliver(2);
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame) << "damaged ones are passed over in the same call";
  EXPECT_EQ(pixel(*frame), 2);
  EXPECT_EQ(camera->counters().incomplete, 3u);
  EXPECT_EQ(camera->counters().lost, 0u) << "nothing is counted twice";
  EXPECT_EQ(statistic(*camera, "error_buffers"), 1);
  EXPECT_EQ(statistic(*camera, "damaged_pictures"), 2);
}

TEST_F(V4l2Faults, WhatIsExposedWhileNobodyWantsItIsNotLost) {
  auto camera = started();
  script->deliver(1);
  const auto before = grab(*camera);
  camera->stop();
  script->pass(4s);
  ASSERT_TRUE(camera->start().ok());
  script->deliver(2);
  const auto after = grab(*camera);
  ASSERT_TRUE(before && after);
  EXPECT_EQ(after->sequence, before->sequence + 1);
  EXPECT_EQ(camera->counters().left_out(), 0u);
}

TEST_F(V4l2Faults, ABufferThatClaimsMoreThanItsMemoryIsCutToIt) {
  auto camera = started();
  script->deliver(std::vector<std::uint8_t>(script->size() * 10, 4), {});
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(pixel(*frame, 7, 3), 4);
}

TEST_F(V4l2Faults, AStallIsToldOnceAndCounted) {
  auto camera = started();
  script->deliver(1);
  grab(*camera);
  script->pass(999ms);
  EXPECT_FALSE(grab(*camera));
  script->pass(2ms);
  EXPECT_EQ(error_of(*camera), ErrorCode::kTimeout);
  script->pass(5s);
  EXPECT_FALSE(grab(*camera));
  script->deliver(1);
  EXPECT_TRUE(grab(*camera));
  EXPECT_FALSE(grab(*camera));
  script->pass(2s);
  EXPECT_EQ(error_of(*camera), ErrorCode::kTimeout) << "a second stall is news again";
  EXPECT_EQ(statistic(*camera, "stalls"), 2);
  const int before = script->streams_on;
  EXPECT_TRUE(camera->start().ok());
  EXPECT_EQ(script->streams_on, before + 1) << "starting a stalled camera begins its stream anew";
}

TEST_F(V4l2Faults, ALostDeviceIsToldAndFoundAgain) {
  auto camera = started();
  script->deliver(1);
  EXPECT_EQ(grab(*camera)->sequence, 0u);
  script->unplug();
  EXPECT_EQ(error_of(*camera), ErrorCode::kDisconnected);
  EXPECT_EQ(script->mapped, 0);
  EXPECT_FALSE(script->open);
  const int opens = script->opens;
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(error_of(*camera), ErrorCode::kDisconnected);
    script->pass(100ms);
  }
  EXPECT_LE(script->opens - opens, 8) << "every half second at most";
  EXPECT_GE(script->opens - opens, 6);

  script->plug();
  script->pass(500ms);
  EXPECT_FALSE(grab(*camera)) << "streaming again, nothing there yet";
  script->deliver(9);
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(pixel(*frame), 9);
  EXPECT_EQ(frame->sequence, 113u) << "4.5 s at 25 Hz";
  EXPECT_EQ(statistic(*camera, "disconnects"), 1);
  EXPECT_EQ(statistic(*camera, "returns"), 1);
  EXPECT_EQ(camera->counters().lost, 112u);
}

TEST_F(V4l2Faults, AHangUpBetweenTwoCallsIsALossToo) {
  auto camera = started();
  script->fails[VIDIOC_DQBUF] = ENODEV;
  EXPECT_EQ(error_of(*camera), ErrorCode::kDisconnected);
  script->fails.clear();
  EXPECT_TRUE(camera->start().ok()) << "starting looks for it at once";
  script->deliver(1);
  EXPECT_TRUE(grab(*camera));
}

TEST_F(V4l2Faults, ADeviceThatComesBackAsAnotherIsNotTaken) {
  auto camera = started();
  script->unplug();
  EXPECT_EQ(error_of(*camera), ErrorCode::kDisconnected);
  script->plug();
  script->width = 16;
  script->pass(1s);
  EXPECT_EQ(error_of(*camera), ErrorCode::kDisconnected);
  script->width = 8;
  script->pass(1s);
  EXPECT_FALSE(grab(*camera));
  EXPECT_EQ(statistic(*camera, "returns"), 1);
}

TEST_F(V4l2Faults, ControlsAreSetAgainWhenTheDeviceComesBack) {
  script->controls[V4L2_CID_AUTOGAIN] = {"Gain, Automatic", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1};
  script->controls[V4L2_CID_GAIN] = {"Gain", V4L2_CTRL_TYPE_INTEGER, 0, 100, 50};
  settings.controls = {{"gain", 7}};
  auto camera = started();
  script->unplug();
  error_of(*camera);
  script->controls[V4L2_CID_AUTOGAIN].value = 1;
  script->controls[V4L2_CID_GAIN].value = 50;
  script->plug();
  script->pass(1s);
  grab(*camera);
  EXPECT_EQ(script->controls[V4L2_CID_AUTOGAIN].value, 0);
  EXPECT_EQ(script->controls[V4L2_CID_GAIN].value, 7);
}

TEST_F(V4l2Faults, AStreamErrorBeginsTheStreamAnewAFewTimesThenIsTold) {
  auto camera = started();
  script->fails[VIDIOC_DQBUF] = EIO;
  EXPECT_FALSE(grab(*camera));
  script->fails.clear();
  script->pass(80ms);
  script->deliver(1);
  EXPECT_TRUE(grab(*camera));
  EXPECT_EQ(script->streams_on, 2);

  script->fails[VIDIOC_DQBUF] = EIO;
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(grab(*camera));
  EXPECT_EQ(error_of(*camera), ErrorCode::kIo);
  EXPECT_EQ(error_of(*camera), ErrorCode::kNotReady);
  EXPECT_EQ(statistic(*camera, "stream_errors"), 5);
  script->fails.clear();
  EXPECT_TRUE(camera->start().ok());
  script->deliver(1);
  EXPECT_TRUE(grab(*camera));
}

TEST_F(V4l2Faults, TooFewBuffersAreRefused) {
  script->most_buffers = 1;
  auto camera = open();
  const Status status = camera->start();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kInternal);
  EXPECT_EQ(script->mapped, 0);
}

/// A picture whose row y is 10 y: a ramp, so that either field interpolates to it.
std::vector<std::uint8_t> ramp(int rows, int first = 0, int step = 10) {
  std::vector<std::uint8_t> bytes;
  for (int y = 0; y < rows; ++y) bytes.insert(bytes.end(), 8, static_cast<std::uint8_t>(first + step * y));
  return bytes;
}

TEST_F(V4l2Fields, WeavingInterlacedRowsTakesThemAsTheyAreAtTheMeanOfBothFields) {
  script->field = V4L2_FIELD_INTERLACED;
  script->standard = V4L2_STD_PAL;
  auto camera = started();
  script->deliver(ramp(4), {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_INTERLACED});
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(pixel(*frame, 0, 3), 30);
  EXPECT_EQ(frame->stamp, script->now - 5ms - 10ms);
  EXPECT_NEAR(seconds(frame->stamp_sigma), 0.010, 2e-5);
}

TEST_F(V4l2Fields, EachFieldIsAFrameOfItsOwnTwentyMillisecondsApart) {
  script->field = V4L2_FIELD_INTERLACED;
  script->standard = V4L2_STD_PAL;  // top field first
  settings.fields = FieldUse::kBoth;
  auto camera = started();
  EXPECT_DOUBLE_EQ(camera->info().rate_hz, 50);
  EXPECT_EQ(camera->info().height, 4);
  script->sequence = 6;
  script->deliver(ramp(4), {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_INTERLACED});
  const auto older = grab(*camera), newer = grab(*camera);
  ASSERT_TRUE(older && newer);
  EXPECT_FALSE(grab(*camera));
  EXPECT_EQ(newer->stamp, script->now - 5ms);
  EXPECT_EQ(newer->stamp - older->stamp, Duration{20ms});
  EXPECT_EQ(newer->sequence, older->sequence + 1);
  EXPECT_EQ(pixel(*older, 0, 1), 10) << "between rows 0 and 2 of the top field";
  EXPECT_EQ(pixel(*older, 0, 3), 20) << "at the edge, the last row of the top field";
  EXPECT_EQ(pixel(*newer, 0, 0), 10) << "at the edge, the first row of the bottom field";
  EXPECT_EQ(pixel(*newer, 0, 2), 20);

  script->sequence += 2;
  script->deliver(ramp(4), {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_INTERLACED});
  EXPECT_EQ(grab(*camera)->sequence, older->sequence + 6);
  EXPECT_EQ(camera->counters().lost, 4u) << "two frames, four pictures";
}

TEST_F(V4l2Fields, BottomFirstSystemsSwapTheFields) {
  script->field = V4L2_FIELD_INTERLACED;
  script->standard = V4L2_STD_NTSC;
  settings.fields = FieldUse::kFirst;
  auto camera = started();
  script->deliver(ramp(4), {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_INTERLACED});
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(pixel(*frame, 0, 0), 10) << "the bottom field's rows";
  EXPECT_EQ(frame->stamp, script->now - 20ms - 5ms);
}

TEST_F(V4l2Fields, SequentialFieldsAreWovenOrOneIsTaken) {
  script->field = V4L2_FIELD_SEQ_TB;
  std::vector<std::uint8_t> picture = ramp(2, 0, 20);
  const auto bottom = ramp(2, 10, 20);
  picture.insert(picture.end(), bottom.begin(), bottom.end());
  for (const FieldUse use : {FieldUse::kWeave, FieldUse::kSecond}) {
    settings.fields = use;
    auto camera = started();
    script->deliver(picture, {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_SEQ_TB});
    const auto frame = grab(*camera);
    ASSERT_TRUE(frame);
    for (int y = 1; y < 4; ++y) EXPECT_EQ(pixel(*frame, 0, y), 10 * y) << "row " << y;
  }
}

class V4l2AlternatingFields : public V4l2Rig {
 protected:
  V4l2AlternatingFields() {
    script->field = V4L2_FIELD_ALTERNATE;
    script->standard = V4L2_STD_PAL;
  }
  /// The fields of frame `n`, stamped at their own ends.
  void deliver_frame(std::uint32_t n, bool top = true, bool bottom = true) {
    script->sequence = n;
    script->pass(20ms);
    if (top) script->deliver(ramp(2, 0, 20), {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_TOP});
    script->pass(20ms);
    if (bottom) script->deliver(ramp(2, 10, 20), {V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_BOTTOM});
  }
};

TEST_F(V4l2AlternatingFields, TwoFieldsOfOneFrameAreWoven) {
  auto camera = started();
  EXPECT_EQ(camera->info().height, 4);
  deliver_frame(0);
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  for (int y = 0; y < 4; ++y) EXPECT_EQ(pixel(*frame, 0, y), 10 * y);
  EXPECT_EQ(frame->stamp, script->now - 10ms - 5ms);
  EXPECT_FALSE(grab(*camera));
  deliver_frame(1, true, false);  // its partner is lost
  deliver_frame(2);
  EXPECT_EQ(grab(*camera)->sequence, 2u);
  EXPECT_EQ(statistic(*camera, "unpaired_fields"), 1);
}

TEST_F(V4l2AlternatingFields, AWovenFrameThatLacksAFieldIsIncompleteOnce) {
  constexpr std::uint32_t kBad = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_ERROR;
  auto camera = started();
  std::uint32_t n = 0;
  deliver_frame(n++);
  ASSERT_TRUE(grab(*camera));
  const auto next = [&](bool top, bool bottom, bool top_bad, bool bottom_bad) {
    script->sequence = n++;
    script->pass(20ms);
    if (top) script->deliver(ramp(2, 0, 20), {top_bad ? kBad : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_TOP});
    script->pass(20ms);
    if (bottom)
      script->deliver(ramp(2, 10, 20), {bottom_bad ? kBad : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, V4L2_FIELD_BOTTOM});
    EXPECT_FALSE(grab(*camera)) << "frame " << n - 1;
  };
  next(true, true, true, false);    // the first field is damaged
  next(true, true, false, true);    // the second
  next(true, true, true, true);     // both
  next(true, false, false, false);  // the second is lost
  next(true, true, true, false);    // and the next frame's first damaged: its second is no partner of what waited
  next(false, true, false, false);  // the first is lost
  deliver_frame(n);
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->sequence, 7u);
  EXPECT_EQ(camera->counters().incomplete, 6u);
  EXPECT_EQ(camera->counters().left_out(), 6u);
}

TEST_F(V4l2AlternatingFields, EachIsAFrameAndTheirGapsAreCounted) {
  settings.fields = FieldUse::kBoth;
  auto camera = started();
  deliver_frame(0);
  const auto a = grab(*camera), b = grab(*camera);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(b->stamp - a->stamp, Duration{20ms});
  EXPECT_EQ(b->stamp, script->now - 5ms);
  EXPECT_EQ(a->sequence, 0u);
  EXPECT_EQ(b->sequence, 1u);
  EXPECT_EQ(pixel(*b, 0, 2), 20);
  grab(*camera);
  deliver_frame(1, false, true);
  EXPECT_EQ(grab(*camera)->sequence, 3u);
  EXPECT_EQ(camera->counters().lost, 1u);
}

TEST_F(V4l2AlternatingFields, OneOfThemIsTaken) {
  settings.fields = FieldUse::kSecond;
  auto camera = started();
  deliver_frame(0);
  const auto frame = grab(*camera);
  ASSERT_TRUE(frame);
  EXPECT_EQ(pixel(*frame, 0, 1), 10);
  EXPECT_FALSE(grab(*camera));
  EXPECT_EQ(camera->counters().lost, 0u);
  EXPECT_DOUBLE_EQ(camera->info().rate_hz, 25);
}

/// Whatever a device does, each frame is whole, sequences grow, and every buffer comes back.
TEST_F(V4l2Faults, FuzzedDevicesNeverBreakTheDriver) {
  const unsigned seed = 90125;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  const auto one_in = [&](unsigned n) { return random() % n == 0; };
  std::uint64_t delivered = 0;
  for (int round = 0; round < 100; ++round) {
    *script = V4l2Script{};
    const std::uint32_t orders[] = {V4L2_FIELD_NONE, V4L2_FIELD_INTERLACED, V4L2_FIELD_SEQ_BT, V4L2_FIELD_ALTERNATE,
                                    V4L2_FIELD_TOP};
    script->field = orders[random() % 5];
    const std::uint32_t formats[] = {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_BGR24, V4L2_PIX_FMT_MJPEG};
    script->offered = {formats[random() % 4]};
    script->padding = random() % 4;
    settings.fields = static_cast<FieldUse>(random() % 4);
    settings.buffers = 2 + static_cast<int>(random() % 4);
    auto camera = started();
    bool in_run = false;
    std::uint64_t last = 0;                // number, in this run
    std::uint64_t known = 0, skipped = 0;  // by the counters, by the frames' numbers
    for (int step = 0; step < 300; ++step) {
      script->pass(Duration{static_cast<std::int64_t>(random() % 60'000'000)});
      if (one_in(200)) script->present = !script->present;
      if (one_in(100)) script->fails[VIDIOC_DQBUF] = one_in(2) ? EIO : EINVAL;
      if (one_in(10)) script->fails.clear();
      if (one_in(50)) script->sequence = random();
      if (!one_in(4)) {
        std::vector<std::uint8_t> bytes(one_in(5) ? random() % (2 * script->size() + 1) : script->size());
        for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
        if (bytes.size() > 3 && one_in(2)) bytes[0] = 0xff, bytes[1] = 0xd8, bytes[2] = 0xff;
        script->deliver(bytes, {one_in(5) ? static_cast<std::uint32_t>(random()) : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC,
                                one_in(2) ? V4L2_FIELD_TOP : V4L2_FIELD_BOTTOM, 0});
      }
      if (one_in(60)) {
        camera->stop();
        (void)camera->start().ok();
        in_run = false;
      }
      auto news = camera->try_grab();
      if (!news.ok()) {
        if (one_in(3)) (void)camera->start().ok();
        continue;
      }
      if (!news.value()) continue;
      ASSERT_EQ(news.value()->image.size(), cv::Size(8, 4));
      ASSERT_EQ(news.value()->image.type(), CV_8UC1);
      const std::uint64_t number = news.value()->sequence;
      ASSERT_TRUE(!in_run || number > last);
      if (!in_run) known = camera->counters().left_out(), skipped = 0;
      if (in_run) skipped += number - last - 1;
      ASSERT_EQ(camera->counters().left_out() - known, skipped) << "round " << round << ", step " << step;
      in_run = true;
      last = number;
      ++delivered;
    }
    camera.reset();
    ASSERT_EQ(script->mapped, 0);
  }
  EXPECT_GT(delivered, 2000u);
}

}  // namespace
}  // namespace tankrig
