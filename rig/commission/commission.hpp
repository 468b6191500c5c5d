// The start-up test: what protects people is tried, one thing after another, with somebody at the tank.
#pragma once

#include <atomic>
#include <functional>

#include "core/clock.hpp"
#include "drivers/laser/relay_proof.hpp"
#include "rig/commission/commission_record.hpp"
#include "rig/commission/deed.hpp"
#include "rig/scan/scan.hpp"

namespace tankrig {

/// Everything the test needs; nothing is owned.
struct CommissionJob {
  const RigConfig& rig;
  const ScanPlan* way = nullptr;  ///< of the arm to `posture`, checked; null: it is there
  const JointVector& posture;     ///< where all is tried
  Clock& clock;
  Arm& arm;
  Laser& laser;
  RelayProof* relay = nullptr;    ///< null: the laser has no refreshes to withhold
  std::vector<Camera*> cameras;   ///< in the rig file's order
  bool has_enable_input = false;  ///< of a watchdog box
  bool reads_interlock = true;    ///< false: wired, this program does not see it
  std::function<bool()> interlock_closed;
  const std::atomic<bool>& stop;
  /// Says it, and how long there is for it; returns at once.
  std::function<void(Deed, Duration within)> ask;
  std::function<void(ScanJob&)> run;  ///< run_scan(), and what belongs to a motion of this rig
  std::function<void(const std::string& step, double fraction)> progress;
  Duration patience = std::chrono::seconds{60};  ///< so long a deed is waited for
  std::vector<CommissionStep> waived;
};

/// Those that a rig may lack, or that somebody may have tested otherwise.
inline constexpr std::array kWaivable{CommissionStep::kBeam, CommissionStep::kLid, CommissionStep::kRelayWatchdog,
                                      CommissionStep::kEnable};

/// Where the beam is tried: `now` if a camera that testifies has the stripe in view there, else the middle of the sweep.
JointVector commission_posture(const RigConfig& rig, const JointVector& now);
/// The elbow's to and fro, while somebody presses the stop.
ScanPlan commission_motion(const ScanSettings& settings, const ArmModel& arm, const JointVector& posture,
                           Duration patience);
/// The longest that the laser shines in one step [s].
double commission_light_s(const CommissionJob& job);

/// Every step but the disk's, whose finding is given. Each makes a run of its own, in which the safety step decides on
/// light and motion as in a scan. One that fails does not keep the next from being tried; a stop does, and so do encoders
/// in doubt, and a run that did not leave laser off and arm at rest confirmed. What was waived is not tried.
/// * encoders: the arm at rest; every joint answers, is where it can be and keeps still. Then the arm goes its `way`.
/// * beam: the arm at rest, laser off, then on: each camera that should see the stripe sees none, then sees it.
/// * lid: opened while the laser is on: the relay's contact is read back open, and the lid closed again.
/// * relay_watchdog: refreshes are withheld while the laser is on: the contact opens by itself, soon enough.
/// * enable: the stop is pressed while the arm moves: the box opens, and the arm is measured at rest.
/// Threads: one, the supervisor's.
/// RT: never.
std::vector<CommissionFinding> commission(const CommissionJob& job, const CommissionFinding& disk);

}  // namespace tankrig
