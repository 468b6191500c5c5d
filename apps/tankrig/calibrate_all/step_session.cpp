#include "apps/tankrig/calibrate_all/step_session.hpp"

#include <fmt/core.h>

#include <opencv2/imgproc.hpp>

#include "apps/tankrig/session/open_session.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "rig/plan/light_check.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

/// Errors: InputError if it is of another rig.
bool is_complete(const fs::path& path, const RigConfig& rig) {
  if (!fs::exists(path / "session.yaml")) return false;
  const SessionInfo info = Session::open(path).info;
  if (info.rig != rig.name)
    throw InputError(path, "is of rig " + shown_text(info.rig) + ", expected " + rig.name + ": take another folder");
  return info.status == "complete";
}

/// PATH.stopped, PATH.stopped-2, ...
void put_aside(const fs::path& path, Progress& progress) {
  fs::path aside = path.string() + ".stopped";
  for (int n = 2; fs::exists(aside); ++n) aside = path.string() + ".stopped-" + std::to_string(n);
  fs::rename(path, aside);
  progress.note(printable(path.string()) + " was stopped: now " + printable(aside.filename().string()) +
                ", recorded again");
}

void record(const ScanOptions& options, const RigConfig& rig, const fs::path& path, const ReadyRig::PlanFrom& plan_from,
            Progress& progress) {
  ReadyRig ready(options, rig, path, plan_from, progress);
  const Recording recording = record_session(options, rig, nullptr, ready.plan(), ready.backend(), path,
                                             ready.commission(), progress, ready.motion());
  ready.disarm();
  progress.finish_line();
  if (!recording.result.complete())
    throw InputError(path, "the recording " + recording.result.status + "; run the same command again to go on");
}

}  // namespace

OpenedSession recorded_step(const ScanOptions& options, const RigConfig& rig, const fs::path& path,
                            const ReadyRig::PlanFrom& plan_from, Progress& progress,
                            const std::function<void()>& before) {
  if (fs::exists(path) && is_complete(path, rig)) {
    progress.note("found " + printable(path.string()) + ", recorded already");
  } else {
    if (fs::exists(path)) put_aside(path, progress);
    before();
    record(options, rig, path, plan_from, progress);
  }
  return open_with_warnings(path, progress);
}

ReadyRig::PlanFrom there_and_back(RigConfig& rig) {
  rig.scan.sweep.passes = 2;
  rig.scan.sweep.there_and_back = true;
  return [&rig](const JointVector& q) {
    ScanPlan plan = make_scan_plan(rig.scan, q);
    check_light(plan, rig.scan.safety);
    for (const RigCamera& camera : rig.cameras) check_witness(plan, rig.scan.safety.beam, camera.name, camera.record);
    return plan;
  };
}

std::vector<std::vector<const FrameRecord*>> dark_frames_by_pass(const Session& session, const std::string& camera) {
  std::vector<std::vector<const FrameRecord*>> passes;
  for (const FrameRecord& frame : session.frames) {
    if (frame.camera != camera || frame.laser_on || frame.phase == Phase::kSweep || frame.phase == Phase::kMove)
      continue;
    const auto pass = static_cast<std::size_t>(frame.pass);
    if (passes.size() <= pass) passes.resize(pass + 1);
    passes[pass].push_back(&frame);
  }
  return passes;
}

cv::Mat mean_picture(const Session& session, const std::vector<const FrameRecord*>& frames) {
  cv::Mat sum;
  for (const FrameRecord* frame : frames) {
    const cv::Mat picture = session.image(*frame);
    if (sum.empty()) sum = cv::Mat::zeros(picture.size(), CV_MAKETYPE(CV_32F, picture.channels()));
    cv::accumulate(picture, sum);
  }
  cv::Mat mean;
  sum.convertTo(mean, CV_8U, 1 / static_cast<double>(frames.size()));
  return mean;
}

cv::Mat grey_of(const cv::Mat& picture) {
  cv::Mat grey = picture;
  if (picture.channels() == 3) cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

}  // namespace tankrig::app
