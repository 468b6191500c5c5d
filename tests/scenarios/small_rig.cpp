#include "tests/scenarios/small_rig.hpp"

#include <cstdio>
#include <memory>

#include "core/input_error.hpp"
#include "rig/scan/scan_log.hpp"
#include "session/recording/session_writer.hpp"
#include "sim_backends/faults/faulty_arm.hpp"
#include "sim_backends/faults/faulty_camera.hpp"
#include "sim_backends/faults/faulty_laser.hpp"
#include "sim_backends/faults/faulty_lux_meter.hpp"
#include "sim_backends/mock/mock_camera.hpp"
#include "sim_backends/mock/mock_lux_meter.hpp"
#include "tests/scenarios/faulty_session.hpp"

namespace tankrig::scenarios {
namespace {

using namespace std::chrono_literals;

ScanSettings small_scan() {
  ScanSettings s;
  s.park << 0, 0.3, 1.0, 0, 0.1;
  s.posture << 0, 0.12, 0, 0, 0.1;
  s.sweep.from = 1.3;
  s.sweep.to = 1.6;
  s.capture.dark_frames = 5;
  s.cycle_hz = 1 / kCyclePeriod;
  return s;
}

cv::Mat taken(cv::Size size, const sim::Exposure& exposure) {
  double light = 0;
  for (const double power : exposure.laser) light += power / static_cast<double>(exposure.laser.size());
  return stripe_picture(size, light, exposure.index);
}

CalibratedCamera described(const CameraInfo& info) {
  CalibratedCamera camera;
  camera.name = info.name;
  camera.role = info.name == "mono" ? CameraRole::kMono : CameraRole::kLeft;
  camera.model.width = info.width;
  camera.model.height = info.height;
  camera.model.fx = camera.model.fy = info.width;
  return camera;
}

struct Rig {
  Rig(const sim::FaultPlan& plan, std::filesystem::path path, cv::Size picture)
      : script(plan),
        mock_arm(arm5e(), {}, s.park, clock),
        mock_laser(from_seconds(s.capture.laser_warm_up), clock),
        faulty_arm(mock_arm, script, clock),
        faulty_laser(mock_laser, script, clock),
        lux_meter(mock_lux_meter, script, clock),
        tape(clock),
        arm(faulty_arm, tape),
        laser(faulty_laser, tape),
        session(std::move(path)) {
    script.mark(sim::FaultOrigin::kStart, clock.now());
    sim::MockCameraParameters parameters;
    parameters.phase = 7ms;
    for (const char* name : {"mono", "left"}) {
      mock_cameras.push_back(std::make_unique<sim::MockCamera>(
          CameraInfo{name, picture.width, picture.height, 1, 25}, parameters, clock, mock_arm, mock_laser,
          [picture](const std::string&, const sim::Exposure& e) { return taken(picture, e); }));
      faulty_cameras.push_back(std::make_unique<sim::FaultyCamera>(*mock_cameras.back(), script, clock));
      cameras.push_back(std::make_unique<TapedCamera>(*faulty_cameras.back(), tape));
    }
  }

  Outcome scan() {
    Outcome out;
    SessionWriterOptions options;
    options.ring_bytes = 0;  // a frame at a time: when a full disk is found is not chance's
    SessionInfo info;
    info.seed = 1;
    for (const auto& camera : cameras) info.cameras.push_back(described(camera->info()));
    try {
      SessionWriter writer(session, info, options);
      run(writer, out);
    } catch (const std::exception& e) {  // what the session could not take
      if (out.status.empty()) out.status = std::string("stopped: ") + e.what();
    }
    measure(out);
    return out;
  }

 private:
  void run(SessionWriter& writer, Outcome& out) {
    FaultySession sink(writer, script, clock, tape, out);
    const ScanPlan plan = make_scan_plan(s, read_posture(arm, clock, 1s));
    std::atomic<bool> stop{false};
    const auto interlock = [&] {
      sink.round();
      for (const sim::FaultEvent& e : script.news(clock.now())) writer.event(e.when, "injected", e.text);
      return sink.interlock();
    };
    const auto always = [](const JointVector&) { return true; };
    ScanJob job{
        plan, s,     clock,
        arm,  laser, {{cameras[0].get(), RecordWhen::kAll, always}, {cameras[1].get(), RecordWhen::kDark, always}},
        sink, stop,  interlock};
    try {
      const ScanResult result = run_scan(job);
      out.status = result.status;
    } catch (const std::exception& e) {
      out.status = std::string("stopped: ") + e.what();
    }
    out.counts = job.result.counts;
    out.account = job.result.account;
    out.left = job.result.left;
    const auto lux = lux_meter.read(1s);
    out.lux = lux.ok() ? std::to_string(lux.value().lux) : describe(lux.error());
    if (!lux.ok()) sink.event(clock.now(), "fault", out.lux);
    writer.info().counts.insert(out.counts.begin(), out.counts.end());
    writer.info().account = out.account;
    writer.close(out.status);
  }

  void measure(Outcome& out) {
    const auto begun = script.plan().faults.empty() ? std::nullopt : script.begin(0);
    out.has_begun = begun && *begun <= clock.now();
    if (out.has_begun) out.begun = *begun;
    std::optional<Stamp> noticed;
    for (const TimedText& e : out.events)
      if (!noticed && (e.kind == "fault" || e.kind == "stop") && out.stopped()) noticed = e.when;
    if (out.stopped() && out.has_begun) out.reaction = reaction(tape.entries(), out.begun, noticed);
    out.beam_left_on = mock_laser.power_at(clock.now()) > 0;
    out.moving = mock_arm.true_velocity_at(clock.now()).cwiseAbs().maxCoeff();
    out.simulated_s = seconds(clock.now() - Stamp{});
  }

  const ScanSettings s = small_scan();
  VirtualClock clock;
  sim::FaultScript script;
  sim::MockArm mock_arm;
  sim::MockLaser mock_laser;
  sim::FaultyArm faulty_arm;
  sim::FaultyLaser faulty_laser;
  sim::MockLuxMeter mock_lux_meter{[] { return 60.0; }, clock};
  sim::FaultyLuxMeter lux_meter;
  CallTape tape;
  TapedArm arm;
  TapedLaser laser;
  std::filesystem::path session;
  std::vector<std::unique_ptr<sim::MockCamera>> mock_cameras;
  std::vector<std::unique_ptr<sim::FaultyCamera>> faulty_cameras;
  std::vector<std::unique_ptr<TapedCamera>> cameras;
};

}  // namespace

cv::Mat stripe_picture(cv::Size size, double light, std::uint64_t index) {
  constexpr int kFloor = 18, kNoise = 5, kStripe = 200;
  cv::Mat image(size, CV_8UC1);
  cv::RNG random(index + 1);
  random.fill(image, cv::RNG::UNIFORM, kFloor, kFloor + kNoise);
  image.rowRange(size.height / 2 - 1, size.height / 2 + 2) += cv::Scalar(kStripe * light);
  return image;
}

bool Outcome::told(const std::string& words) const {
  if (status.find(words) != std::string::npos) return true;
  for (const TimedText& e : events)
    if (e.text.find(words) != std::string::npos) return true;
  return false;
}

Outcome scan_with_faults(const sim::FaultPlan& plan, const std::filesystem::path& session, cv::Size picture) {
  plan.check(sim::FaultLevel::kMock);
  return Rig(plan, session, picture).scan();
}

}  // namespace tankrig::scenarios
