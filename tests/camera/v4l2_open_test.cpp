// Opening a V4L2 camera: what it says when it cannot, what it agrees on, and the controls it sets.
#include <gmock/gmock.h>

#include "core/config_node.hpp"
#include "drivers/camera/v4l2_controls.hpp"
#include "tests/camera/v4l2_rig.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using namespace std::chrono_literals;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

using V4l2Open = V4l2Rig;

TEST_F(V4l2Open, ErrorsNameCameraAndDeviceAndSayWhatToDo) {
  script->open_fails = EACCES;
  EXPECT_EQ(refusal(), "mono: /dev/video7: no permission: sudo usermod -aG video $USER, then log in again");
  script->open_fails = ENOENT;
  EXPECT_THAT(refusal(), StartsWith("mono: /dev/video7: no such camera: plug it in, or name another ("));
  script->open_fails = EBUSY;
  EXPECT_THAT(refusal(), HasSubstr("in use by another program"));
  script->open_fails = ENOTTY;
  EXPECT_THAT(refusal(), HasSubstr("not a video device"));
  script->open_fails = 0;
  script->fails[VIDIOC_QUERYCAP] = ENOTTY;
  EXPECT_THAT(refusal(), HasSubstr("not a video device"));
}

TEST_F(V4l2Open, ARealPathThatIsNoDeviceIsRefused) {
  const TemporaryFolder folder;
  settings.device = folder.write("video0", "").string();
  EXPECT_THAT(message_of<InputError>([&] { V4l2Camera camera(settings); }), HasSubstr("not a video device"));
  settings.device = (folder.path() / "gone").string();
  EXPECT_THAT(message_of<InputError>([&] { V4l2Camera camera(settings); }), HasSubstr("no such camera"));
}

TEST_F(V4l2Open, DevicesThatDoNotCaptureOrStreamAreRefusedWithTheirKind) {
  script->capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal(),
              HasSubstr("'scripted' is an output device: a loopback captures only after its writer has begun"));
  script->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal(), HasSubstr("does not capture video"));
  script->capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal(), HasSubstr("multi-planar"));
  script->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
  EXPECT_THAT(refusal(), HasSubstr("cannot stream to memory"));
}

TEST_F(V4l2Open, AFormatThatIsNotOfferedIsAnErrorThatListsTheOfferedOnes) {
  script->offered = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_NV12};
  settings.formats = {PixelFormat::kGrey};
  EXPECT_EQ(refusal(), "mono: /dev/video7: pixel_format: found GREY, the device offers: YUYV MJPEG 'NV12'");
  script->offered.clear();
  EXPECT_THAT(refusal(), HasSubstr("the device offers: none"));
}

TEST_F(V4l2Open, ASizeThatTheDeviceDoesNotGiveIsAnErrorThatSaysWhatItGives) {
  settings.width = 640;
  settings.height = 480;
  EXPECT_THAT(refusal(), HasSubstr("asked for 640x480 field order any, the device gives: GREY 8x4 field order none"));
}

TEST_F(V4l2Open, ThePreferenceListDecidesAmongTheOfferedFormats) {
  script->offered = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_BGR24};
  EXPECT_THAT(open()->description(), HasSubstr("YUYV 8x4")) << "grey of YUYV is luma as coded";
  settings.channels = 3;
  EXPECT_THAT(open()->description(), HasSubstr("BGR24 8x4"));
  settings.formats = {PixelFormat::kUyvy, PixelFormat::kMjpeg, PixelFormat::kYuyv};
  EXPECT_THAT(open()->description(), HasSubstr("MJPEG 8x4"));
}

TEST_F(V4l2Open, AFormatThatReachesTheRateIsTakenBeforeOneThatDoesNot) {
  script->offered = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
  script->fastest_hz = {{V4L2_PIX_FMT_YUYV, 5}, {V4L2_PIX_FMT_MJPEG, 30}};
  settings.rate_hz = 30;
  auto camera = open();
  EXPECT_THAT(camera->description(), HasSubstr("MJPEG"));
  EXPECT_DOUBLE_EQ(camera->info().rate_hz, 30);

  settings.rate_hz = 60;
  camera = open();
  EXPECT_THAT(camera->description(), HasSubstr("YUYV"));
  EXPECT_DOUBLE_EQ(camera->info().rate_hz, 5);
  EXPECT_THAT(camera->warnings(), Contains("rate: asked for 60 Hz, the device gives 5 Hz in YUYV"));
  EXPECT_EQ(script->format.pixelformat, V4L2_PIX_FMT_YUYV) << "and the device stands at it";
}

TEST_F(V4l2Open, ABusyDeviceIsToldAtItsFormatAndAtItsStart) {
  script->fails[VIDIOC_S_FMT] = EBUSY;
  EXPECT_THAT(refusal(), HasSubstr("in use by another program"));
  script->fails.clear();
  auto camera = open();
  script->fails[VIDIOC_STREAMON] = ENOSPC;
  const Status full = camera->start();
  ASSERT_FALSE(full.ok());
  EXPECT_EQ(full.error().code, ErrorCode::kRefused);
  EXPECT_EQ(full.error().os_errno, ENOSPC) << "the USB bus has no bandwidth left";
  EXPECT_EQ(script->mapped, 0);
  script->fails.clear();
  EXPECT_TRUE(camera->start().ok());
}

TEST_F(V4l2Open, GrabbersTakeInputAndStandard) {
  script->standard = V4L2_STD_NTSC;
  settings.standard = "PAL";
  settings.input = 1;
  open();
  EXPECT_EQ(script->standard, V4L2_STD_PAL);
  settings.input = 5;
  EXPECT_THAT(refusal(), HasSubstr("input: found 5, and the device refuses it"));
  settings.input.reset();
  script->standard = 0;
  EXPECT_THAT(refusal(), HasSubstr("standard: the device refuses PAL"));
}

TEST_F(V4l2Open, AGrabberThatDoesNotTellItsRateHasItsStandards) {
  script->fails[VIDIOC_G_PARM] = ENOTTY;
  script->standard = V4L2_STD_PAL;
  EXPECT_DOUBLE_EQ(open()->info().rate_hz, 25);
  script->standard = V4L2_STD_NTSC;
  EXPECT_NEAR(open()->info().rate_hz, 29.97, 0.001);
  script->standard = 0;
  EXPECT_EQ(open()->info().rate_hz, 0);
}

std::map<std::uint32_t, V4l2Script::Control> webcam() {
  return {{V4L2_CID_BRIGHTNESS, {"Brightness", V4L2_CTRL_TYPE_INTEGER, -64, 64, 0}},
          {V4L2_CID_AUTO_WHITE_BALANCE, {"White Balance, Automatic", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1}},
          {V4L2_CID_GAIN, {"Gain", V4L2_CTRL_TYPE_INTEGER, 0, 100, 50}},
          {V4L2_CID_AUTOGAIN, {"Gain, Automatic", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1}},
          {V4L2_CID_EXPOSURE_AUTO, {"Auto Exposure", V4L2_CTRL_TYPE_MENU, 0, 3, 3}},
          {V4L2_CID_EXPOSURE_ABSOLUTE, {"Exposure Time, Absolute", V4L2_CTRL_TYPE_INTEGER, 1, 5000, 157}},
          {V4L2_CID_FOCUS_AUTO, {"Focus, Automatic Continuous", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1}}};
}

TEST_F(V4l2Open, AutomaticsAreOffUnlessAskedFor) {
  script->controls = webcam();
  const auto camera = open();
  EXPECT_EQ(script->controls[V4L2_CID_EXPOSURE_AUTO].value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(script->controls[V4L2_CID_AUTOGAIN].value, 0);
  EXPECT_EQ(script->controls[V4L2_CID_AUTO_WHITE_BALANCE].value, 0);
  EXPECT_EQ(script->controls[V4L2_CID_FOCUS_AUTO].value, 0);
  EXPECT_EQ(script->controls[V4L2_CID_GAIN].value, 50) << "nothing else is touched";
  EXPECT_EQ(statistic(*camera, "control_auto_exposure"), V4L2_EXPOSURE_MANUAL) << "what was set is told";

  script->controls = webcam();
  settings.controls = {{"auto_exposure", 3}};
  open();
  EXPECT_EQ(script->controls[V4L2_CID_EXPOSURE_AUTO].value, 3) << "what the rig file names is the rig file's";
  EXPECT_EQ(script->controls[V4L2_CID_AUTOGAIN].value, 0);

  script->controls = webcam();
  settings.controls.clear();
  settings.keep_automatics = true;
  script->set_controls.clear();
  open();
  EXPECT_TRUE(script->set_controls.empty());
  EXPECT_EQ(script->controls[V4L2_CID_AUTOGAIN].value, 1);
}

TEST_F(V4l2Open, AnAutomaticThatStaysOnIsAWarning) {
  script->controls = webcam();
  script->controls[V4L2_CID_AUTOGAIN].refuses = EACCES;
  EXPECT_THAT(open()->warnings(), Contains("gain_automatic cannot be switched off (Permission denied)"));
}

TEST_F(V4l2Open, ControlsAreSetByNameOldOrNewOrByIdAndReadBack) {
  script->controls = webcam();
  settings.controls = {{"exposure_absolute", 100}, {"exposure_time_absolute", 120}, {"gain", 0}, {"0x00980900", -5}};
  settings.exposure.reset();
  const auto camera = open();
  EXPECT_EQ(script->controls[V4L2_CID_EXPOSURE_ABSOLUTE].value, 120);
  EXPECT_EQ(script->controls[V4L2_CID_GAIN].value, 0);
  EXPECT_EQ(script->controls[V4L2_CID_BRIGHTNESS].value, -5);
  EXPECT_EQ(statistic(*camera, "control_exposure_time_absolute"), 120);
  EXPECT_EQ(statistic(*camera, "control_brightness"), -5);
  EXPECT_DOUBLE_EQ(statistic(*camera, "exposure_s"), 0.012) << "exposure is told by the control, in units of 100 us";
}

TEST_F(V4l2Open, UnknownControlsListTheKnownOnesAndValuesTheirRange) {
  script->controls = webcam();
  settings.controls = {{"contrast", 1}};
  EXPECT_EQ(refusal(),
            "mono: /dev/video7: controls: found 'contrast', expected one of: brightness, white_balance_automatic, "
            "gain_automatic, "
            "gain, auto_exposure, exposure_time_absolute, focus_automatic_continuous");
  settings.controls = {{"gain", 101}};
  EXPECT_EQ(refusal(), "mono: /dev/video7: controls: gain: found 101, expected 0..100");
  script->controls[V4L2_CID_GAIN].refuses = EBUSY;
  settings.controls = {{"gain", 1}};
  EXPECT_THAT(refusal(), HasSubstr("controls: gain: the device refuses 1 (Device or resource busy; range 0..100)"));
}

TEST_F(V4l2Open, AnUnknownExposureIsAWarning) {
  settings.exposure.reset();
  EXPECT_THAT(open()->warnings(), Contains("the device does not tell its exposure time: give exposure_s"));
}

ConfigNode node_of(const TemporaryFolder& folder, const std::string& yaml) {
  return ConfigNode::load(folder.write("camera.yaml", yaml));
}

TEST(V4l2Settings, EveryKeyIsRead) {
  const TemporaryFolder folder;
  const ConfigNode node = node_of(folder, R"(device: /dev/v4l/by-id/usb-Grabber-video-index0
width_px: 720
height_px: 576
rate_hz: 25
pixel_format: UYVY
field_order: interlaced-tb
fields: both
input: 1
standard: PAL
controls: {exposure_auto: 1, exposure_absolute: 100, 0x00980913: 0}
keep_automatics: true
exposure_s: 0.02
readout_s: 0.019
rolling_shutter: true
stamp_clock: monotonic
stamp_point: start
stamp_sigma_s: 0.001
buffers: 6
timeout_s: 2
retry_s: 0.25
)");
  const V4l2CameraSettings got = v4l2_settings_from(node, "bowtech", 3);
  node.finish();
  EXPECT_EQ(got.name, "bowtech");
  EXPECT_EQ(got.device, "/dev/v4l/by-id/usb-Grabber-video-index0");
  EXPECT_EQ(got.width, 720);
  EXPECT_EQ(got.height, 576);
  EXPECT_EQ(got.rate_hz, 25);
  EXPECT_EQ(got.formats, std::vector{PixelFormat::kUyvy});
  EXPECT_EQ(got.field_order, "interlaced-tb");
  EXPECT_EQ(got.fields, FieldUse::kBoth);
  EXPECT_EQ(got.input, 1);
  EXPECT_EQ(got.standard, "PAL");
  ASSERT_EQ(got.controls.size(), 3u);
  EXPECT_EQ(got.controls[1].name, "exposure_absolute");
  EXPECT_EQ(got.controls[1].value, 100);
  EXPECT_TRUE(got.keep_automatics);
  EXPECT_EQ(got.exposure, Duration{20ms});
  EXPECT_EQ(got.readout, Duration{19ms});
  EXPECT_TRUE(got.rolling_shutter);
  EXPECT_EQ(got.stamp_clock, StampClock::kMonotonic);
  EXPECT_EQ(got.stamp_point, StampPoint::kStart);
  EXPECT_EQ(got.stamp_sigma, Duration{1ms});
  EXPECT_EQ(got.buffers, 6);
  EXPECT_EQ(got.timeout, Duration{2s});
  EXPECT_EQ(got.retry, Duration{250ms});
}

TEST(V4l2Settings, DefaultsNeedTheDeviceAlone) {
  const TemporaryFolder folder;
  const ConfigNode node = node_of(folder, "device: /dev/video2\n");
  const V4l2CameraSettings got = v4l2_settings_from(node, "a", 1);
  node.finish();
  EXPECT_TRUE(got.formats.empty());
  EXPECT_FALSE(got.exposure);
  EXPECT_FALSE(got.keep_automatics);
  EXPECT_EQ(got.fields, FieldUse::kWeave);
}

TEST(V4l2Settings, BadValuesAreRefusedWithTheirLine) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& line) {
    return message_of<InputError>([&] {
      const ConfigNode node = node_of(folder, "device: /dev/video0\n" + line + "\n");
      v4l2_settings_from(node, "a", 1);
      node.finish();
    });
  };
  EXPECT_THAT(refusal("pixel_format: YUY2"),
              HasSubstr("camera.yaml:2: pixel_format: found 'YUY2', expected one of: auto, GREY"));
  EXPECT_THAT(refusal("fields: odd"), HasSubstr("camera.yaml:2: fields"));
  EXPECT_THAT(refusal("buffers: 1"), HasSubstr("camera.yaml:2: buffers"));
  EXPECT_THAT(refusal("exposure_s: 20"), HasSubstr("camera.yaml:2: exposure_s"));
  EXPECT_THAT(refusal("width_px: 640"), HasSubstr("expected width_px and height_px together"));
  EXPECT_THAT(refusal("controls: {gain: high}"), HasSubstr("gain"));
  EXPECT_THAT(refusal("exposure: 1"), HasSubstr("exposure"));
}

}  // namespace
}  // namespace tankrig
