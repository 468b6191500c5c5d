// A rig of real drivers on emulated wires, in real time: what the reliability table measures.
#pragma once

#include <atomic>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "rig/guardian/guardian.hpp"
#include "sim_backends/faults/picture_faults.hpp"
#include "sim_backends/wire/box_emulator.hpp"
#include "sim_backends/wire/wire_faults.hpp"
#include "tests/scenarios/small_rig.hpp"

namespace tankrig::scenarios {

/// The emulated devices, serving below `runtime` and at 127.0.0.1, with a fault plan played on them. Laser and arm have no
/// watchdog of their own, as none is known of the real arm: they go on when nobody commands them any more. A watchdog box
/// feeds both, and somebody presses its button.
class EmulatedRig {
 public:
  EmulatedRig(const std::filesystem::path& runtime, const sim::FaultPlan& plan);
  ~EmulatedRig();

  const sim::RelayEmulator& relay() const { return *relay_; }
  sim::ArmEmulator& arm() { return *arm_; }
  const sim::BoxEmulator& box() const { return *box_; }
  sim::FaultScript& script() { return script_; }
  /// The laser's line, the arm's line and the arm's place on its bus.
  void pull_lines();
  void plug_lines();
  /// The middle of the exposure that gave this picture; nothing: several did, or none.
  std::optional<Stamp> exposed(const cv::Mat& picture) const;

 private:
  MonotonicClock clock_;
  sim::FaultScript script_;
  static constexpr double kLux = 60;
  double last_lux_ = kLux;
  sim::MockLaser laser_;
  std::unique_ptr<sim::PictureFaults> pictures_;
  mutable std::mutex mutex_;                             // guards what follows
  std::map<std::size_t, std::optional<Stamp>> exposed_;  // by the picture's hash; nothing: several exposures gave it
  std::unique_ptr<sim::CanHub> hub_;
  std::unique_ptr<sim::ArmEmulator> arm_;
  std::unique_ptr<sim::RelayEmulator> relay_;
  std::unique_ptr<sim::BoxEmulator> box_;  // its contactors feed the two above
  std::unique_ptr<sim::LuxEmulator> lux_;
  std::unique_ptr<sim::GigeCameraEmulator> camera_;
  std::unique_ptr<sim::WireFaults> faults_;
};

/// What guards a scan of it.
GuardianSettings guardian_settings(const std::filesystem::path& runtime, const std::string& carrier);

/// Scans it behind its watchdog box over `carrier`, "can" or "serial", with the drivers of the rig file's section. `rig`: the emulated devices,
/// where they are in this process; what the fault's begin is taken from.
/// `guarded`: with a guardian, whose process is written to runtime/guardian.pid.
Outcome scan_wire(const std::filesystem::path& runtime, const std::string& carrier,
                  const std::filesystem::path& session, EmulatedRig* rig, bool guarded = false);

}  // namespace tankrig::scenarios
