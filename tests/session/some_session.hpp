// A small session with known content, for the tests to damage.
#pragma once

#include <filesystem>

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "session/reading/session_yaml.hpp"
#include "session/recording/session_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {

inline constexpr CameraModel kSmall{8, 6, 10.123456789012345, 11.0 / 3, 3.5, 2.5, -0.37, 0.174, -0.0016, 0.0029, 1e-17};

inline SessionInfo some_info() {
  SessionInfo info;
  info.kind = "scan";
  info.operator_name = "Ada \"the\" operator";
  info.notes = "two lines\nand: a colon, #hash, back\\slash, µ";
  info.rig = "tank-sim";
  info.rig_hash = "0123";
  info.software = "0.1.0";
  info.noise = "gaussian sd 0.01";
  info.seed = 0xfffffffffffffffeULL;
  info.light = 1.0 / 3;
  info.lux_source = "hand";
  info.lux_before = 207.1;
  info.simulated_s = 12.345678901234567;
  info.counts["not_recorded"] = 7;
  info.clock_begin = ClockPair{{999'000'000}, 1'790'000'000'123'456'789};
  info.clock_end = ClockPair{{1'300'000'000}, 1'790'000'000'424'456'790};
  info.devices = {{"arm.bus_load_percent", 12.5}, {"sync.residual_p99_ms", 1.0 / 7}};
  info.timing = SessionTiming{100, 1234, 2, 1, {10.5, 20, 30, 41.25}, {1, 2, 3, 4}, {9999, 10001, 10010, 10100.5}};
  info.platform = {{"kernel", "6.1.0 #1 SMP"}, {"memory", "locked: \"all\""}};
  info.cameras = {{"mono", CameraRole::kMono, kSmall, make_transform_rpy({-0.285, 0.045, 0.12}, {0.1, 0.2, -1.5})}};
  info.calibration.arm = arm5e();
  info.calibration.ePl = Plane{Vector3d(1, 2, -0.5).normalized(), 0.09796};
  info.calibration.laser_origin_e = {-0.09796, 0, -0.188};
  info.calibration.laser_direction_e = Vector3d(0, 0.6, 0.8);
  info.calibration.laser_fan = 1.0 / 1.1;
  info.object = SessionObject{"box.obj", make_transform_rpy({0.5, -0.25, 1.09}, {3.14159, 0, 0.61})};
  return info;
}

/// Without an object and a rig file.
inline SessionInfo bare_info() {
  SessionInfo info = some_info();
  info.object.reset();
  info.rig_hash.clear();
  return info;
}

/// Stands in for rig/config: a rig.yaml of one line knows the calibration.
inline void describe_rig(const std::filesystem::path& rig_yaml, SessionInfo& info) {
  if (read_whole_file(rig_yaml) != "the rig\n") throw InputError(rig_yaml, "expected the rig");
  info.rig = some_info().rig;
  take_calibration(some_info(), info);
}

inline cv::Mat test_image(int seed) {
  cv::Mat image(kSmall.height, kSmall.width, CV_8UC3);
  for (int i = 0; i < image.rows * image.cols * 3; ++i) image.data[i] = static_cast<uchar>((i * 37 + seed * 101) % 256);
  return image;
}

inline FrameRecord some_frame(int index) {
  FrameRecord frame;
  frame.camera = "mono";
  frame.index = index;
  frame.sequence = 100 + static_cast<std::uint64_t>(index);
  frame.stamp = {1'000'000'000LL + index * 40'000'000LL};
  frame.stamp_sigma = Duration{56789 + index};
  frame.exposure = std::chrono::milliseconds(10);
  frame.phase = index % 2 ? Phase::kSweep : Phase::kDarkBefore;
  frame.pass = index;
  frame.laser_on = index % 2;
  frame.sync_residual = Duration{1234 + index};
  frame.q = JointVector::Zero();
  *frame.q << 0, 0.12, 0.9 + index / 3.0, 1e-300, -0.1;
  return frame;
}

/// With the name of its picture, as a writer gives it.
inline FrameRecord filed_frame(int index) {
  FrameRecord frame = some_frame(index);
  frame.file = "frames/mono/00000" + std::to_string(index) + ".png";
  return frame;
}

inline JointState some_joints(int index) {
  JointState state;
  state.stamp = {1'000'000'000LL + index * 5'000'000LL};
  state.q << 0.1 * index, 1.0 / 3, -1e-17, 3, 4;
  state.velocity << 0, 0.1, 0.2, 0.3, 1.0 / 7;
  state.ticks = {1, -2, 2147483647, -2147483647 - 1, index};
  state.current_a = 0.6;
  return state;
}

inline void record(SessionWriter& writer, int frames) {
  for (int i = 0; i < frames; ++i) {
    for (int j = 0; j < 8; ++j) writer.joints(some_joints(i * 8 + j));
    writer.frame(some_frame(i), test_image(i));
  }
  writer.event({5}, "phase", "sweep, \"pass\" 0\nbegins");
}

inline std::filesystem::path recorded(const TemporaryFolder& folder, int frames = 5) {
  SessionWriter writer(folder.path() / "s", some_info());
  record(writer, frames);
  writer.close("complete");
  return folder.path() / "s";
}

}  // namespace tankrig
