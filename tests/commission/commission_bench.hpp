// A rig of mocks that a start-up test is made of, with somebody at its lid and its stop.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "rig/commission/commission.hpp"
#include "sim_backends/mock/mock_camera.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig::testing_support {

/// A mock behind a relay that opens by itself when nothing is sent to it any more.
class ProofLaser final : public Laser, public RelayProof {
 public:
  ProofLaser(sim::MockLaser& behind, const Clock& clock) : behind_(behind), clock_(clock) {}

  std::optional<Duration> watchdog = std::chrono::seconds{1};

  Result<LaserState> state() noexcept override;
  Duration warm_up() const noexcept override { return behind_.warm_up(); }
  void withhold_refreshes(bool withheld) noexcept override;
  std::optional<Duration> opened_by_itself() const noexcept override;

 private:
  Status set(bool on) noexcept override { return Laser::set(behind_, on); }

  sim::MockLaser& behind_;
  const Clock& clock_;
  mutable std::mutex mutex_;  // guards what follows
  std::optional<Stamp> withheld_since_;
  std::optional<Duration> opened_;
};

/// tank-sim's rig file, its first camera a mock, the arm where that one sees the stripe.
/// `Any` clock: a virtual one, or a real one where a watchdog box takes part.
template <class AnyClock>
struct CommissionBench {
  RigConfig rig = load_rig(std::filesystem::path(TANKRIG_SOURCE_DIR) / "etc/rigs/tank-sim/rig.yaml");
  AnyClock clock;
  JointVector posture = lit_posture(rig);
  sim::MockArm arm{rig.arm, {}, posture, clock};
  sim::MockLaser lamp{std::chrono::milliseconds{500}, clock};
  ProofLaser laser{lamp, clock};
  std::unique_ptr<sim::MockCamera> camera;
  WatchdogBox* box = nullptr;
  std::atomic<bool> stop{false};
  std::optional<ScanPlan> way;  ///< to `posture`
  bool lid_closed = true, reads_interlock = true;
  bool lid_in_stop = false;  ///< it has contacts in the stop's channels as well
  bool lid_contact_works = true;
  std::set<Deed> refused;  ///< nobody does it
  std::function<void(bool pressed)> press_stop = [](bool) {};
  std::vector<Deed> asked;
  std::vector<CommissionStep> waived;
  Duration patience = std::chrono::seconds{3};

  CommissionBench() {
    rig.cameras.resize(1);
    camera = std::make_unique<sim::MockCamera>(
        CameraInfo{rig.cameras[0].name, 320, 240, 1, 25}, sim::MockCameraParameters{}, clock, arm, lamp,
        [this](const std::string&, const sim::Exposure& e) { return picture(e.laser[0], e.index); });
  }

  std::vector<CommissionFinding> run(const CommissionFinding& disk = {CommissionStep::kDisk, CommissionVerdict::kPassed,
                                                                      "room"}) {
    const CommissionJob job{.rig = rig,
                            .way = way ? &*way : nullptr,
                            .posture = posture,
                            .clock = clock,
                            .arm = arm,
                            .laser = laser,
                            .relay = &laser,
                            .cameras = {camera.get()},
                            .has_enable_input = box != nullptr,
                            .reads_interlock = reads_interlock,
                            .interlock_closed = [this] { return lid_closed; },
                            .stop = stop,
                            .ask = [this](Deed deed, Duration) { does(deed); },
                            .run =
                                [this](ScanJob& scan) {
                                  scan.box = box;
                                  run_scan(scan);
                                },
                            .progress = {},
                            .patience = patience,
                            .waived = waived};
    return commission(job, disk);
  }

 private:
  static JointVector lit_posture(const RigConfig& rig) {
    JointVector q = rig.scan.posture;
    q[kElbow] = 0.5 * (rig.scan.sweep.from + rig.scan.sweep.to);
    return q;
  }

  static cv::Mat picture(double light, std::uint64_t index) {
    cv::Mat image(240, 320, CV_8UC1);
    cv::RNG random(index + 1);
    random.fill(image, cv::RNG::UNIFORM, 18, 23);
    image.rowRange(59, 62) += cv::Scalar(200 * light);
    return image;
  }

  void does(Deed deed) {
    asked.push_back(deed);
    if (refused.contains(deed)) return;
    if (deed == Deed::kOpenLid) lid_closed = !lid_contact_works;
    if (deed == Deed::kCloseLid) lid_closed = true;
    if (lid_in_stop && deed == Deed::kOpenLid) press_stop(true);
    if (lid_in_stop && deed == Deed::kCloseLid) press_stop(false);
    if (deed == Deed::kPressStop) press_stop(true);
    if (deed == Deed::kReleaseStop) press_stop(false);
  }
};

}  // namespace tankrig::testing_support
