// The real ARM5E: its joint slots on CAN or on the serial line, as the cycle's Arm. Its rooms: requests and answers
// (arm_requests), encoders (arm_encoders), faults (arm_faults), the zero (known_zero), the thread beside the cycle
// (arm_keeper), what is counted (arm_counts).
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>

#include "drivers/arm/arm.hpp"
#include "drivers/arm/arm_encoders.hpp"
#include "drivers/arm/arm_faults.hpp"
#include "drivers/arm/arm_keeper.hpp"
#include "drivers/arm/arm_requests.hpp"
#include "drivers/arm/known_zero.hpp"

namespace tankrig {

/// Set-points are exchanged against encoder readings at the rate of the settings; in between the newest waits. A joint
/// state of an arm that is not homed has ticks since power-up and angles that are not numbers. With a fast joint,
/// set-points and readings of the others take kFastRound exchanges to come round; stop() and the first request after a
/// silence are whole all the same. The arm counts as silent when any joint has not been heard from.
///
/// Faults, each told once by try_read and then kept: over-current, water, a machine that was suspended; until homed,
/// encoders that lost their reference, an axis beyond its limits. The arm is stopped, set-points are refused, states go
/// on.
///
/// Threads: the cycle's; stop(), last_resort() and statistics() any. Whoever is inside holds a flag that nobody waits
/// for: a stop() that finds it taken leaves its wish behind, and the holder sends it before it goes. A thread of its
/// own, where the clock is real, stops an arm that gets no set-points (also when the cycle hangs, and past it where it
/// hangs inside) and opens a line that came back.
/// RT: try_read, write_velocity, write_ticks, stop.
class Arm5e final : public Arm {
 public:
  /// `clock` outlives the arm.
  Arm5e(const Arm5eSettings& settings, const ArmModel& model, std::unique_ptr<ArmLink> link, const Clock& clock);
  ~Arm5e() override;
  Arm5e(const Arm5e&) = delete;
  Arm5e& operator=(const Arm5e&) = delete;

  /// Errors: kTimeout (silent, or an encoder that stood though it was driven, until it moves), kDisconnected, kInternal
  /// (its thread is dead or stuck), the faults above, each "arm: ...". Silence counts from when somebody listens:
  /// nobody did while the program prepared.
  Result<std::optional<JointState>> try_read() noexcept override;
  /// Errors: kNotReady "arm: not homed" or "arm: bus-off", kOutOfRange, kDisconnected, the fault that is kept, kRefused
  /// for a motion before begin_motion().
  Result<JointVector> write_velocity(const JointVector& velocity) noexcept override;
  /// Sends at once, then at the exchange rate. Ok also when another thread is inside: that one sends it.
  Status stop() noexcept override;
  void last_resort() noexcept override { requests_.last_resort(); }
  Duration exchange_period() const noexcept override { return requests_.period(); }
  Statistics statistics() const override;

  /// Speed demands without angles, for homing and jogging: whole ticks/s, within +-4095. Not refused for want of a
  /// zero. Threads,
  /// RT: the cycle's.
  Status write_ticks(const std::array<int, kJoints>& ticks_per_s) noexcept;

  /// The zero of a file, believed or not with the first readings; until begin_motion() nothing is driven.  Before
  /// anything else is called.
  void set_proof(ZeroProof proof) { zero_.set_proof(std::move(proof)); }
  /// Why the zero of the file is not believed, or no longer; empty where there is no such file in the settings.
  /// Threads: the cycle's.
  /// RT: never, nor the next three.
  std::string why_not_homed() const { return zero_.why_not(); }
  /// The arm may be driven from here on. Without end_motion() it has to be homed before the next program drives it.
  /// Errors: InputError.
  void begin_motion() { zero_.begin_motion(); }
  /// It is not driven any more. `rests`: that was seen just now.
  /// Errors: InputError.
  void end_motion(bool rests);
  /// Where the zero was lost: voids the file too.
  /// Errors: InputError.
  void keep_loss() { zero_.keep_loss(); }

  bool homed() const noexcept { return zero_.known(); }
  /// From here on angles are known. The zero is checked against the limits with the next reading.
  /// Threads: the cycle's.
  void set_zero(const ArmZero& zero) noexcept;
  /// Before homing: angles are no longer known, and what homing ends is forgotten.
  /// Threads: the cycle's.
  void forget_zero() noexcept;
  /// Of the newest answer.
  /// Threads: the cycle's.
  const ArmReadings& readings() const noexcept { return readings_; }
  /// As newest believed: unlike readings().raw never a false zero far from where it was.
  /// Threads: the cycle's.
  const EncoderTrack& encoder(Joint joint) const noexcept { return encoders_[joint]; }
  /// Errors: kRefused while it is not over, or while the arm is just being stopped; what only homing ends.

  const Arm5eSettings& settings() const noexcept { return settings_; }
  const ArmModel& model() const noexcept { return model_; }

 private:
  bool enter() noexcept { return !inside_.test_and_set(); }
  void leave() noexcept;
  void raise(ArmFault fault) noexcept;
  void lose_reference() noexcept;
  Status refusal(Stamp now, bool by_ticks) const noexcept;
  Result<std::optional<JointState>> drain(Stamp now) noexcept;
  std::optional<JointState> take(const ArmRequests::News& news) noexcept;
  void judge_zero() noexcept;
  void watch(const JointState& state) noexcept;
  void set_demand(const std::array<double, kJoints>& ticks_per_s, Stamp now) noexcept;
  Status rest(Stamp now) noexcept;
  void publish() noexcept { counts_.publish(requests_.link_counters(), readings_); }
  void tend(bool suspended, Heartbeat& life) noexcept;

  const Arm5eSettings settings_;
  const ArmModel model_;
  const Clock& clock_;
  const double bus_load_;
  ArmCounts counts_;

  std::atomic_flag inside_ = ATOMIC_FLAG_INIT;  // guards what follows, up to the atomics
  ArmRequests requests_;
  ArmEncoders encoders_;
  ArmReadings readings_;
  ArmFaults faults_;
  KnownZero zero_;
  SuspendWatch suspend_watch_;

  std::atomic<bool> stop_wanted_{false};
  std::atomic<std::int64_t> written_ns_{0};  ///< newest set-point

  std::optional<ArmKeeper> keeper_;  // last: its thread uses all of the above
};

/// Opens the carrier, checks its load, loads the zero file if it is there; with one in the settings the arm is only
/// read until begin_motion(). Says nothing to an arm that another program moves.
/// Errors: InputError that says what to do.
std::unique_ptr<Arm5e> open_arm5e(const Arm5eSettings& settings, const ArmModel& model, const Clock& clock);

}  // namespace tankrig
