#include "rig/capture/frame_joiner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "session/recording/event_kinds.hpp"

namespace tankrig {
namespace {

/// The least value that a share of the values does not exceed.
template <class T>
T quantile(std::vector<T> values, double share) {
  if (values.empty()) return {};
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace

FrameJoiner::FrameJoiner(const ScanPlan& plan, const ScanSettings& settings, const JointHistory& joints,
                         const LaserTimeline& laser, ScanSink& sink)
    : plan_(plan), settings_(settings), joints_(joints), laser_(laser), sink_(sink) {}

int FrameJoiner::add_camera(const std::string& name, RecordWhen record, bool at_angles) {
  PerCamera camera;
  camera.name = name;
  camera.record = record;
  camera.at_angles = at_angles;
  camera.per_segment.assign(plan_.segments().size(), 0);
  cameras_.push_back(std::move(camera));
  return static_cast<int>(cameras_.size()) - 1;
}

bool FrameJoiner::records(const PerCamera& camera, const Segment& segment) const {
  if (segment.phase == Phase::kMove) return false;
  const bool dark = segment.phase != Phase::kSweep;
  return camera.record == RecordWhen::kAll || dark == (camera.record == RecordWhen::kDark);
}

bool FrameJoiner::wanted(int camera, Stamp begin, Stamp end) const {
  if (!plan_zero_) return false;
  const double from = seconds(begin - *plan_zero_), to = seconds(end - *plan_zero_);
  return std::any_of(plan_.segments().begin(), plan_.segments().end(), [&](const Segment& s) {
    return records(cameras_[static_cast<std::size_t>(camera)], s) && from < s.record_end && to > s.record_begin;
  });
}

/// The segment whose recorded part holds the exposure, if the camera records it.
const Segment* FrameJoiner::segment_of(const PerCamera& camera, const Frame& frame) const {
  if (!plan_zero_) return nullptr;
  const double middle = seconds(frame.stamp - *plan_zero_), half = 0.5 * seconds(frame.exposure);
  const auto holds = [&](const Segment& s) {
    if (camera.at_angles && s.phase == Phase::kSweep) return middle >= s.begin && middle < s.end();
    return middle - half >= s.record_begin && middle + half <= s.record_end;
  };
  for (const Segment& s : plan_.segments())
    if (records(camera, s) && holds(s)) return &s;
  return nullptr;
}

void FrameJoiner::add(int number, Frame frame) {
  PerCamera& camera = cameras_[static_cast<std::size_t>(number)];
  const Segment* segment = segment_of(camera, frame);
  if (!segment) {
    not_used(camera, "not_recorded", frame.stamp);
    return;
  }
  const std::size_t i = static_cast<std::size_t>(segment - plan_.segments().data());
  if (segment->phase != Phase::kSweep && camera.per_segment[i] >= settings_.capture.dark_frames) {
    not_used(camera, "not_recorded", frame.stamp);
    return;
  }
  ++camera.per_segment[i];
  waiting_.push_back({number, std::move(frame)});
}

std::uint64_t FrameJoiner::add_silence(int number, const Frame& last, Duration period, Stamp end, std::uint64_t known) {
  PerCamera& camera = cameras_[static_cast<std::size_t>(number)];
  std::uint64_t silent = 0;
  Frame due;
  due.exposure = last.exposure;
  for (due.stamp = last.stamp + period; due.stamp + period < end; due.stamp = due.stamp + period) {
    const Segment* segment = segment_of(camera, due);
    if (!segment) continue;
    int& taken = camera.per_segment[static_cast<std::size_t>(segment - plan_.segments().data())];
    if (segment->phase != Phase::kSweep && taken >= settings_.capture.dark_frames) continue;
    ++taken;
    ++silent;
  }
  if (silent <= known) return silent;
  counts_[camera.name + ".silent"] += silent - known;
  sink_.event(end, event_kind::kDrop, camera.name + ": silent x " + std::to_string(silent - known));
  return known;
}

void FrameJoiner::drain() {
  while (!waiting_.empty() && try_join(waiting_.front())) waiting_.pop_front();
}

void FrameJoiner::finish() {
  drain();
  for (; !waiting_.empty(); waiting_.pop_front()) {
    const Waiting& w = waiting_.front();
    not_used(cameras_[static_cast<std::size_t>(w.camera)], why_waiting(w), w.frame.stamp);
  }
}

void FrameJoiner::give_up() {
  for (const Waiting& w : waiting_) ++counts_[cameras_[static_cast<std::size_t>(w.camera)].name + "." + why_waiting(w)];
  waiting_.clear();
}

const char* FrameJoiner::why_waiting(const Waiting& waiting) const {
  const Frame& frame = waiting.frame;
  if (!joints_.interpolate(frame.stamp).ok()) return "joints_after";
  const auto light = laser_.during(frame.stamp - frame.exposure / 2, frame.stamp + frame.exposure / 2);
  return light == LaserTimeline::Light::kNotYetKnown ? "laser_unknown" : "recorder_failed";
}

/// True once the frame is recorded or counted; false while its joints are still to come.
bool FrameJoiner::try_join(const Waiting& waiting) {
  PerCamera& camera = cameras_[static_cast<std::size_t>(waiting.camera)];
  const Frame& frame = waiting.frame;
  const auto light = laser_.during(frame.stamp - frame.exposure / 2, frame.stamp + frame.exposure / 2);
  const auto joints = joints_.interpolate(frame.stamp);
  if (light == LaserTimeline::Light::kNotYetKnown) return false;
  if (!joints.ok()) {
    if (joints.error().code == ErrorCode::kNotReady) return false;
    not_used(camera, joints.error().code == ErrorCode::kOutOfRange ? "joints_before" : "joint_gap", frame.stamp);
    return true;
  }
  if (light == LaserTimeline::Light::kMixed) {
    not_used(camera, "laser_switching", frame.stamp);
    return true;
  }
  const Segment& segment = *segment_of(camera, frame);
  const bool on = light == LaserTimeline::Light::kOn;
  const bool wrong = segment.phase == Phase::kSweep ? !on && !settings_.capture.laser_pairs : on;
  if (wrong) {
    not_used(camera, "laser_wrong", frame.stamp);
    return true;
  }

  FrameRecord record;
  record.camera = camera.name;
  record.sequence = frame.sequence;
  record.stamp = frame.stamp;
  record.stamp_sigma = frame.stamp_sigma;
  record.exposure = frame.exposure;
  record.phase = segment.phase;
  record.pass = segment.pass;
  record.laser_on = on;
  record.q = joints.value().q;
  record.sync_residual = joints.value().residual;
  const double speed =
      settings_.target ? speed_on_target(*settings_.target, joints.value().q, joints.value().velocity) : 0;
  record.sync_on_target = seconds(record.sync_residual) * speed;
  if (!passes_gate(camera, record, speed)) return true;
  record.index = camera.index++;
  residuals_.push_back(record.sync_residual);
  residuals_on_target_.push_back(record.sync_on_target);
  stamp_sigmas_.push_back(record.stamp_sigma);
  sink_.frame(record, frame.image);
  ++counts_[camera.name + ".recorded"];
  return true;
}

bool FrameJoiner::passes_gate(const PerCamera& camera, const FrameRecord& record, double speed_on_target) {
  const SyncGate& gate = settings_.sync;
  const double time = gate.worst(record.sync_residual, record.stamp_sigma), length = time * speed_on_target;
  if (time <= gate.max_residual && length <= gate.max_residual_on_target) return true;
  sink_.event(
      record.stamp, event_kind::kDrop,
      fmt::format("{}: sync_gate: {:.3f} ms, of these {:g} sigma of its stamp {:.3f} ms, {:.3f} mm on the target, "
                  "expected at most {:g} ms and {:g} mm",
                  camera.name, 1e3 * time, gate.kSigmas, 1e3 * (time - seconds(record.sync_residual)), 1e3 * length,
                  1e3 * gate.max_residual, 1e3 * gate.max_residual_on_target));
  ++counts_[camera.name + ".sync_gate"];
  return false;
}

Duration FrameJoiner::residual(double share) const { return quantile(residuals_, share); }

double FrameJoiner::residual_on_target(double share) const { return quantile(residuals_on_target_, share); }

Duration FrameJoiner::stamp_sigma(double share) const { return quantile(stamp_sigmas_, share); }

void FrameJoiner::not_used(const PerCamera& camera, const char* reason, Stamp when) {
  if (std::strcmp(reason, "not_recorded") != 0) sink_.event(when, event_kind::kDrop, camera.name + ": " + reason);
  ++counts_[camera.name + "." + reason];  // a frame that still waits when the sink throws is counted later
}

}  // namespace tankrig
