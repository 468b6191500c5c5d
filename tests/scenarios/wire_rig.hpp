// A rig of real drivers on emulated wires, in real time: what the reliability table measures.
#pragma once

#include <atomic>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "sim_backends/faults/picture_faults.hpp"
#include "sim_backends/wire/wire_faults.hpp"
#include "tests/scenarios/small_rig.hpp"

namespace tankrig::scenarios {

/// The emulated devices, serving below `runtime` and at 127.0.0.1, with a fault plan played on them.
class EmulatedRig {
 public:
  EmulatedRig(const std::filesystem::path& runtime, const sim::FaultPlan& plan);
  ~EmulatedRig();

  const sim::RelayEmulator& relay() const { return *relay_; }
  sim::ArmEmulator& arm() { return *arm_; }
  sim::FaultScript& script() { return script_; }
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
  std::unique_ptr<sim::LuxEmulator> lux_;
  std::unique_ptr<sim::GigeCameraEmulator> camera_;
  std::unique_ptr<sim::WireFaults> faults_;
};

/// Scans it over `carrier`, "can" or "serial", with the drivers of the rig file's section. `rig`: the emulated devices,
/// where they are in this process; what the fault's begin is taken from.
Outcome scan_wire(const std::filesystem::path& runtime, const std::string& carrier,
                  const std::filesystem::path& session, EmulatedRig* rig);

}  // namespace tankrig::scenarios
