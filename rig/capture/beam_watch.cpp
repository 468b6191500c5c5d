#include "rig/capture/beam_watch.hpp"

#include <cstring>

#include "rig/plan/light_check.hpp"

namespace tankrig {
namespace {

constexpr int kAbsent = 12;               // triples; fewer are no stripe
constexpr double kLeastContrast = 0.5;    // of a stray beam, relative to the newest stripe
constexpr std::size_t kMostWaiting = 64;  // frames
constexpr double kMoved = 2e-3;           // by so much a stripe's picture is another one [rad]

bool same_bits(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  const std::size_t row = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int r = 0; r < a.rows; ++r)
    if (std::memcmp(a.ptr(r), b.ptr(r), row) != 0) return false;
  return true;
}

}  // namespace

void BeamWatch::add_camera(const std::string& name, StripeInView in_view) {
  PerCamera& camera = cameras_.emplace_back();
  camera.testifies = testifies(settings_, name);
  camera.in_view = std::move(in_view);
}

void BeamWatch::add(const CycleRecord& record) {
  const bool emitting = record.laser ? record.laser->emitting : emitting_;
  if (record.laser_commanded != commanded_ || emitting != emitting_) switched_ = record.stamp;
  commanded_ = record.laser_commanded;
  emitting_ = emitting;
  was_lit_ = was_lit_ || emitting_;
}

void BeamWatch::add(int camera, const Frame& frame) {
  if (!cameras_[static_cast<std::size_t>(camera)].testifies) return;
  if (waiting_.size() == kMostWaiting) waiting_.pop_front();
  waiting_.push_back(
      {camera, frame.stamp - frame.exposure / 2, frame.stamp, frame.stamp + frame.exposure / 2, frame.image});
}

BeamVerdict BeamWatch::judge() {
  while (!waiting_.empty() && verdict_ == BeamVerdict::kNone) {
    const Waiting& frame = waiting_.front();
    const auto light = laser_.during(frame.begin, frame.end);
    if (light == LaserTimeline::Light::kNotYetKnown) break;
    if (light == LaserTimeline::Light::kOn && !joints_known(frame)) break;
    const bool settled = !switched_ || frame.begin - *switched_ >= settle_ || *switched_ - frame.end >= settle_;
    PerCamera& camera = cameras_[static_cast<std::size_t>(frame.camera)];
    if (settled && light == LaserTimeline::Light::kOn) {
      if (camera.dark.count() == 0) blind_ = frame.camera;
      judge_lit(camera, frame);
    }
    if (settled && light == LaserTimeline::Light::kOff) judge_dark(camera, frame);
    waiting_.pop_front();
  }
  return verdict_;
}

/// Or will never be.
bool BeamWatch::joints_known(const Waiting& frame) const {
  const auto joints = joints_.interpolate(frame.middle);
  return joints.ok() || joints.error().code != ErrorCode::kNotReady;
}

void BeamWatch::judge_lit(PerCamera& camera, const Waiting& frame) {
  const auto sign = look_for_stripe(frame.image, camera.dark.mean());
  if (!sign) return;
  const auto joints = joints_.interpolate(frame.middle);
  const bool expected = camera.in_view && joints.ok() && camera.in_view(joints.value().q);
  if (sign->present()) camera.lit_contrast = sign->contrast;
  if (sign->present() && joints.ok()) judge_repeats(camera, frame, joints.value().q);
  if (!expected) return;
  ++lit_;
  lit_seen_ += sign->present();
  camera.missing = sign->triples < kAbsent ? camera.missing + 1 : 0;
  if (camera.missing >= settings_.frames) verdict_ = BeamVerdict::kMissing;
}

void BeamWatch::judge_repeats(PerCamera& camera, const Waiting& frame, const JointVector& q) {
  if (!same_bits(camera.lit, frame.image)) {
    camera.lit = frame.image;
    camera.lit_q = q;
    camera.repeated = 0;
    return;
  }
  if ((q - camera.lit_q).cwiseAbs().maxCoeff() < kMoved) return;
  if (++camera.repeated >= settings_.frames) repeating_ = frame.camera;
}

void BeamWatch::judge_dark(PerCamera& camera, const Waiting& frame) {
  if (!was_lit_ && camera.dark.count() < settings_.dark_frames) return camera.dark.add(frame.image);
  const auto sign = look_for_stripe(frame.image, camera.dark.mean());
  if (!sign) return;
  const bool seen = sign->present() && sign->contrast >= kLeastContrast * camera.lit_contrast;
  ++dark_;
  dark_clear_ += !seen;
  camera.stray = seen ? camera.stray + 1 : 0;
  if (camera.stray >= settings_.frames) verdict_ = BeamVerdict::kStray;
}

std::string BeamWatch::summary() const {
  const auto text = [](int n) { return std::to_string(n); };
  std::string line = "beam seen in " + text(lit_seen_) + " of " + text(lit_) + " lit frames, not seen in " +
                     text(dark_clear_) + " of " + text(dark_) + " dark ones";
  for (const std::string& name : settings_.waived) line += (&name == &settings_.waived[0] ? "; waived: " : ", ") + name;
  return line;
}

}  // namespace tankrig
