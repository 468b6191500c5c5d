// The real ARM5E: its joint slots on CAN or on the serial line, as the cycle's Arm. Its parts: requests and answers
// (arm_requests), encoders (arm_encoders), faults (arm_faults), the zero (known_zero), the thread beside the cycle
// (arm_keeper), counts (arm_counts).
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

/// Exchanges set-points for encoder readings at the rate of the settings; in between the newest set-point waits. An arm
/// that is not homed gives ticks since power-up, and NaN for angles. With a fast joint, the other joints' set-points
/// and readings come round within kFastRound exchanges; stop() and the first request after a silence are whole all the
/// same. The arm counts as silent when any joint has not been heard from.
///
/// try_read reports each fault once; the fault then lasts. Over-current, water and a suspended machine last as long as
/// the program; a lost encoder reference and an axis beyond its limits last until homing. The arm is stopped and
/// set-points are refused; states continue.
///
/// Threads: the cycle's; stop(), last_resort() and statistics() any. The thread inside holds a flag that nobody waits
/// for. A stop() that finds it taken leaves a request, and the holder sends it before leaving. In real time a thread of
/// its own stops an arm that gets no set-points (also past a cycle that hangs inside), asks it to rest until somebody
/// listens again, and reopens a line that came back.
/// RT: try_read, write_velocity, write_ticks, stop.
class Arm5e final : public Arm {
 public:
  /// `clock` outlives the arm.
  Arm5e(const Arm5eSettings& settings, const ArmModel& model, std::unique_ptr<ArmLink> link, const Clock& clock);
  ~Arm5e() override;
  Arm5e(const Arm5e&) = delete;
  Arm5e& operator=(const Arm5e&) = delete;

  /// Errors: kTimeout (silent, or a driven encoder stands still, until it moves), kDisconnected, kInternal (its thread
  /// is dead or stuck), the faults above, each "arm: ...". Silence counts only from the first call after a long pause.
  Result<std::optional<JointState>> try_read() noexcept override;
  /// Errors: kNotReady "arm: not homed" or "arm: bus-off", kOutOfRange, kDisconnected, the lasting fault, kRefused for
  /// a motion before begin_motion().
  Result<JointVector> write_velocity(const OutputRight& right, const JointVector& velocity) noexcept override;
  /// Whole ticks/s, within +-4095. Works without a zero.
  Status write_ticks(const OutputRight& right, const TickSpeeds& ticks_per_s) noexcept override;
  /// Sends at once, then at the exchange rate. Ok also if another thread is inside: that one sends it.
  Status stop() noexcept override;
  void last_resort() noexcept override { requests_.last_resort(); }
  /// While `veto` is set by another process, nothing but rest is sent. It outlives this.
  /// Threads: any.
  void set_veto(const std::atomic<bool>& veto) noexcept { requests_.set_veto(veto); }
  Duration exchange_period() const noexcept override { return requests_.period(); }
  Statistics statistics() const override;

  /// The zero from a file. The first readings decide whether it is believed; nothing is driven until begin_motion().
  /// Call it before anything else.
  void set_proof(ZeroProof proof) { zero_.set_proof(std::move(proof)); }
  /// Why the file's zero is not believed, or no longer; empty if the settings name no file.
  /// Threads: the cycle's.
  /// RT: never, nor the next three.
  std::string why_not_homed() const { return zero_.why_not(); }
  /// Allows motion. Without end_motion() the arm must be homed before the next program drives it.
  /// Errors: InputError.
  void begin_motion() { zero_.begin_motion(); }
  /// Ends motion. `rests`: the arm was just seen at rest.
  /// Errors: InputError.
  void end_motion(bool rests);
  /// If the zero was lost, voids the file too.
  /// Errors: InputError.
  void keep_loss() { zero_.keep_loss(); }

  bool homed() const noexcept { return zero_.known(); }
  /// Where homing should find the zero; nothing if nobody knows.
  /// Threads: the cycle's.
  std::optional<ExpectedZero> expected_zero() const noexcept { return zero_.expected(encoders_.raw()); }
  /// Angles are known from here on. The next reading checks the zero against the limits.
  /// Threads: the cycle's.
  void set_zero(const ArmZero& zero) noexcept;
  /// Before homing: angles are unknown again, and faults that homing ends are cleared.
  /// Threads: the cycle's.
  void forget_zero() noexcept;
  /// Of the newest answer.
  /// Threads: the cycle's.
  const ArmReadings& readings() const noexcept { return readings_; }
  /// The newest believed position; unlike readings().raw never a false zero far from the last position.
  /// Threads: the cycle's.
  const EncoderTrack& encoder(Joint joint) const noexcept { return encoders_[joint]; }

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
  std::atomic<bool> left_{false};            ///< the keeper has stopped it, and nobody has listened since

  std::optional<ArmKeeper> keeper_;  // last: its thread uses all of the above
};

/// Opens the carrier, checks its load, loads the zero file if it exists; if the settings name one, the arm is only read
/// until begin_motion(). Sends nothing to an arm that another program moves.
/// Errors: InputError that says what to do.
std::unique_ptr<Arm5e> open_arm5e(const Arm5eSettings& settings, const ArmModel& model, const Clock& clock);

}  // namespace tankrig
