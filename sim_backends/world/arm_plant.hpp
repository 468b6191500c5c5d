// The arm's mechanics and motors: from speed demands in ticks/s to the true position of the links.
#pragma once

#include <array>
#include <mutex>
#include <vector>

#include "core/arm_model.hpp"
#include "core/time.hpp"

namespace tankrig::sim {

/// Time constant and currents are assumptions; the currents' sizes suit the laboratory's thresholds (docs/reference/arm5e.md).
struct ArmPlantParameters {
  double time_constant = 0.03;                           ///< first-order lag of every actuator's velocity [s]
  std::array<double, kJoints> backlash_ticks{};          ///< total backlash between encoder and link
  std::array<double, kJoints> stiction_ticks_per_s{};    ///< slower demands move nothing
  std::array<double, kJoints> speed_gain = unit_gain();  ///< ticks/s an actuator makes of a demand of 1 ticks/s
  double quiescent_a = 0.2;                              ///< the whole arm at rest
  double current_a_per_tick_s = 1e-4;                    ///< of a moving axis
  double stall_a = 1.6;                                  ///< of an axis that pushes against its stop
  double stall_rise = 0.05;                              ///< time constant of that current [s]

  static constexpr std::array<double, kJoints> unit_gain() { return {1, 1, 1, 1, 1}; }
};

/// Each actuator's speed [ticks/s] follows its demand with a first-order lag, integrated exactly between demands; the
/// joint limits are hard stops, backlash lies between encoder and link.
/// Threads: any; a mutex guards the memory.
/// RT: nothing allocates after construction.
class ArmPlant {
 public:
  static constexpr std::int64_t kHistory = 4096;  ///< demands remembered

  /// One axis at an instant.
  struct Axis {
    double ticks = 0, speed = 0;  ///< of the encoder's side [ticks, ticks/s]
    double demand = 0;            ///< the speed it tends to, after stiction and gain [ticks/s]
    double link = 0;              ///< of the link's side, behind the backlash [ticks]
    double stalled = 0;           ///< how long it has pushed against its stop [s]
  };
  using Axes = std::array<Axis, kJoints>;

  /// Powers on at `start`, at rest in posture `q`, clamped to the limits.
  ArmPlant(const ArmModel& model, const ArmPlantParameters& parameters, const JointVector& q, Stamp start);

  /// Drives the axes with these demands from `when` on. Demands come in order of time; a late one acts at the time of
  /// the one before it.
  void drive(Stamp when, const std::array<double, kJoints>& ticks_per_s) noexcept;

  /// State at `when`; before the oldest remembered demand, its state.
  Axes axes_at(Stamp when) const noexcept;
  /// State at the newest demand.
  Axes newest() const noexcept;

  /// Where the links are, exactly.
  JointVector truth_at(Stamp when) const noexcept;
  /// Velocity of the links, without backlash [rad/s].
  JointVector true_velocity_at(Stamp when) const noexcept;
  /// The supply current of the arm [A].
  double current_at(Stamp when) const noexcept;

 private:
  struct Knot {
    Stamp when{};
    Axes axes{};
  };

  Axis axis_after(std::size_t joint, const Axis& begin, double t) const noexcept;
  Axes axes_after(const Knot& knot, Stamp when) const noexcept;
  const Knot& knot(std::int64_t n) const noexcept { return history_[static_cast<std::size_t>(n % kHistory)]; }
  const Knot& knot_before(Stamp when) const noexcept;

  const ArmModel model_;
  const ArmPlantParameters parameters_;
  std::array<double, kJoints> min_ticks_{}, max_ticks_{};
  mutable std::mutex mutex_;  // guards what follows
  std::vector<Knot> history_;
  std::int64_t last_ = 0;  // newest knot
};

}  // namespace tankrig::sim
