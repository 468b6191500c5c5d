// A whole mock rig, ready to be scanned.
#pragma once

#include <memory>

#include "rig/scan/before_start.hpp"
#include "rig/scan/scan.hpp"
#include "sim_backends/mock/mock_camera.hpp"
#include "tests/support/recording_sink.hpp"

namespace tankrig::testing_support {

/// One mono camera, one stereo eye for the dark blocks. A picture's pixel says
/// how lit it was: 0 dark, 3 lit in the whole exposure.
template <class AnyClock>
struct MockRigUnder {
  ScanSettings s;
  sim::MockParameters mock;
  ArmModel model = arm5e();
  AnyClock clock;
  RecordingSink sink;
  std::atomic<bool> stop{false};
  std::function<void(const ScanProgress&)> progress;
  std::function<bool()> interlock_closed = [] { return true; };
  std::function<void(const std::string&)> cut;
  StepWatch* step_watch = nullptr;
  EndState left;  ///< as the job says, also after an exception

  std::unique_ptr<sim::MockArm> arm;
  std::unique_ptr<sim::MockLaser> laser;
  std::vector<std::unique_ptr<sim::MockCamera>> cameras;
  std::unique_ptr<ScanPlan> plan;
  std::map<std::string, int> rendered;

  MockRigUnder() {
    s.park << 0, 0.3, 1.0, 0, 0.1;
    s.posture << 0, 0.12, 0, 0, 0.1;
    s.sweep.from = 1.3;
    s.sweep.to = 1.8;
    s.capture.dark_frames = 5;
    mock.camera.phase = std::chrono::milliseconds{7};
  }

  void power_on() {
    arm = std::make_unique<sim::MockArm>(model, mock.arm, s.park, clock);
    laser = std::make_unique<sim::MockLaser>(mock.laser_warm_up, clock);
    for (const char* name : {"mono", "left"}) {
      auto source = [this](const std::string& camera, const sim::Exposure& e) {
        ++rendered[camera];
        return cv::Mat(2, 2, CV_8UC1, cv::Scalar(e.laser[0] + e.laser[1] + e.laser[2]));
      };
      cameras.push_back(
          std::make_unique<sim::MockCamera>(CameraInfo{name, 2, 2, 1, 25}, mock.camera, clock, *arm, *laser, source));
    }
  }

  ScanResult run() {
    if (!arm) power_on();
    plan = std::make_unique<ScanPlan>(make_scan_plan(s, read_posture(*arm, clock, std::chrono::seconds{1})));
    ScanJob job{*plan,    s,      clock,
                *arm,     *laser, {{cameras[0].get(), RecordWhen::kAll}, {cameras[1].get(), RecordWhen::kDark}},
                sink,     stop,   interlock_closed,
                progress, cut,    step_watch};
    try {
      const ScanResult result = run_scan(job);
      left = job.result.left;
      return result;
    } catch (...) {
      left = job.result.left;
      throw;
    }
  }
};

using MockRig = MockRigUnder<VirtualClock>;

}  // namespace tankrig::testing_support
