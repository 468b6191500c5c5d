// The real ARM5E: its joint slots on CAN or on the serial line, as the cycle's Arm.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>

#include "core/clock.hpp"
#include "core/heartbeat.hpp"
#include "core/suspend_watch.hpp"
#include "drivers/arm/arm.hpp"
#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/arm/arm_faults.hpp"
#include "drivers/arm/arm_readings.hpp"
#include "drivers/arm/motion_evidence.hpp"
#include "drivers/arm/zero_proof.hpp"

namespace tankrig {

/// Set-points are exchanged against encoder readings at the rate of the settings; in between the newest waits. A joint
/// state of an arm that is not homed has ticks since power-up and angles that are not numbers. With a fast joint,
/// set-points and readings of the others take kFastRound exchanges to come round; stop() and the first request after a
/// silence are whole all the same. An arm of which anything has not been heard of is silent.
///
/// The encoders were read at some time between a request and its answer, and nothing in an answer says to which request
/// it is. So nothing but a stop is sent while an answer may still come, and one that comes too late, unasked, or first
/// after such a one or after none, is counted and left.
///
/// Faults, each told once by try_read and then kept until clear_faults(): over-current, water, encoders that lost their
/// reference, an axis beyond its limits, a machine that was suspended. The arm is stopped, set-points are refused,
/// states go on.
///
/// Threads: the cycle's; stop(), last_resort() and statistics() any. Whoever is inside holds a flag that nobody waits
/// for: a stop() that finds it taken leaves its wish behind, and the holder sends it before it goes. A thread of its
/// own, where the clock is real, stops an arm that gets no set-points (also when the cycle hangs, and past it where it
/// hangs inside) and opens a line that came back.
/// RT: try_read, write_velocity, write_ticks, stop, clear_faults.
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
  void last_resort() noexcept override;
  Duration exchange_period() const noexcept override { return period_; }
  Statistics statistics() const override;

  /// Speed demands without angles, for homing and jogging: whole ticks/s, within +-4095. Not refused for want of a
  /// zero. Threads,
  /// RT: the cycle's.
  Status write_ticks(const std::array<int, kJoints>& ticks_per_s) noexcept;

  /// The zero of a file, believed or not with the first readings; until begin_motion() nothing is driven.  Before
  /// anything else is called.
  void set_proof(ZeroProof proof);
  /// Why the zero of the file is not believed, or no longer; empty where there is no such file in the settings.
  /// Threads: the cycle's.
  /// RT: never, nor the next three.
  std::string why_not_homed() const;
  /// The arm may be driven from here on. Without end_motion() it has to be homed before the next program drives it.
  /// Errors: InputError.
  void begin_motion();
  /// It is not driven any more. `rests`: that was seen just now.
  /// Errors: InputError.
  void end_motion(bool rests);
  /// Where the zero was lost: voids the file too.
  /// Errors: InputError.
  void keep_loss();

  bool homed() const noexcept { return homed_.load(std::memory_order_relaxed); }
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
  std::uint16_t believed_raw(Joint joint) const noexcept { return tracks_[joint].raw(); }
  Stamp believed_at(Joint joint) const noexcept { return tracks_[joint].when(); }
  /// Errors: kRefused while it is not over, or while the arm is just being stopped; what only homing ends.
  Status clear_faults() noexcept override;

  const Arm5eSettings& settings() const noexcept { return settings_; }
  const ArmModel& model() const noexcept { return model_; }

 private:
  using Count = std::atomic<std::uint64_t>;

  bool enter() noexcept { return !inside_.test_and_set(); }
  void leave() noexcept;
  void raise(ArmFault fault) noexcept;
  void lose_reference() noexcept;
  Status refusal(Stamp now, bool by_ticks) const noexcept;
  Result<std::optional<JointState>> drain(Stamp now) noexcept;
  std::optional<JointState> take(const ArmAnswer& answer, bool asked, Stamp now) noexcept;
  bool is_late(const ArmAnswer& answer, bool asked) noexcept;
  void note(const ArmAnswer& answer) noexcept;
  JointState state() const noexcept;
  void watch(const JointState& state) noexcept;
  void judge_zero() noexcept;
  bool silent(Stamp now) const noexcept;
  Duration answer_time() const noexcept;
  void lose() noexcept;
  void repeat(Stamp now) noexcept;
  Status pump(Stamp now, bool at_once) noexcept;
  Status send(const ArmExchange& exchange, Stamp now) noexcept;
  ArmDemands limited(ArmDemands demands) const noexcept;
  void rest() noexcept;
  void set_demand(const std::array<double, kJoints>& ticks_per_s, Stamp now) noexcept;
  void publish() noexcept;
  void keep();

  const Arm5eSettings settings_;
  const ArmModel model_;
  const Clock& clock_;
  const Duration period_;
  const ArmDemands rest_;
  const double bus_load_;

  std::atomic_flag inside_ = ATOMIC_FLAG_INIT;  // guards what follows, up to the atomics
  std::unique_ptr<ArmLink> link_;
  ArmDemands demands_{};
  ExchangeSchedule schedule_;
  std::array<EncoderTrack, kJoints> tracks_;
  ArmReadings readings_;
  ArmAnswer last_;
  MotionEvidence evidence_;
  LastHeard heard_;
  bool changed_in_round_ = true;
  bool gains_next_ = true, gains_answered_ = false, gains_last_ = false;
  bool wobble_ = false;     ///< which of two equivalent frames is sent
  bool stop_sent_ = false;  ///< every joint's newest demand on the wire is rest
  bool in_time_ = false;    ///< the newest answer was
  int stop_awaits_ = 0;     ///< answers up to the one to a stop
  bool connected_ = true, was_silent_ = false;
  Stamp next_send_{}, sent_at_{}, listened_{};
  Stamp asked_at_{};  ///< the oldest request that is not answered, or an older one
  ArmFaults faults_;
  SuspendWatch suspend_watch_;

  std::optional<ZeroProof> proof_;
  const char* lost_ = nullptr;  ///< why the zero that was believed is none any more
  bool may_move_ = true;

  std::atomic<bool> homed_{false}, stop_wanted_{false}, line_lost_{false}, dying_{false};
  std::atomic<bool> driven_{false};          ///< a demand is not rest
  std::atomic<std::int64_t> written_ns_{0};  ///< newest set-point
  Count exchanges_{0}, timeouts_{0}, mute_retries_{0}, late_answers_{0}, stale_{0}, jumps_rejected_{0}, jumps_{0},
      watchdog_stops_{0}, over_currents_{0}, water_alarms_{0}, disconnects_{0};
  std::array<Count, 10> link_counts_{};
  std::atomic<double> current_a_{0}, voltage_v_{0}, temperature_c_{0};

  std::mutex keeper_mutex_;
  std::condition_variable keeper_wake_;
  bool keeper_ends_ = false;
  Heartbeat keeper_life_;
  SuspendWatch keeper_suspend_watch_;
  std::thread keeper_;
};

/// Opens the carrier, checks its load, loads the zero file if it is there; with one in the settings the arm is only
/// read until begin_motion(). Says nothing to an arm that another program moves.
/// Errors: InputError that says what to do.
std::unique_ptr<Arm5e> open_arm5e(const Arm5eSettings& settings, const ArmModel& model, const Clock& clock);

}  // namespace tankrig
