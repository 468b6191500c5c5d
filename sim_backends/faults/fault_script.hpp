// A fault plan in progress: which of its faults are on at this moment.
#pragma once

#include <atomic>
#include <optional>
#include <string_view>
#include <vector>

#include "sim_backends/faults/fault_plan.hpp"

namespace tankrig::sim {

struct FaultEvent {
  Stamp when{};
  std::string text;  ///< "camera mono: unplugged begins"
};

/// Nothing begins before its origin is marked.
/// Threads: any; news() from one.
/// RT: all but the constructor and news().
class FaultScript {
 public:
  explicit FaultScript(FaultPlan plan);

  const FaultPlan& plan() const noexcept { return plan_; }

  /// Marks the origin; only the first time counts.
  void mark(FaultOrigin origin, Stamp when) noexcept;
  /// The scan enters a phase; the first time counts.
  void enter_phase(std::string_view name, Stamp when) noexcept;

  /// When fault `index` begins; nothing before its origin.
  std::optional<Stamp> begin(std::size_t index) const noexcept;
  /// Whether it is between begin and end. An intermittent fault is active throughout: see off_now().
  bool active(std::size_t index, Stamp now) const noexcept;
  /// The first active fault of this kind; null if there is none. `camera`: of that name, or of every camera.
  const FaultSpec* active(FaultDevice device, FaultKind kind, Stamp now, std::string_view camera = {}) const noexcept;
  /// Whether an intermittent fault has the device off at this moment.
  bool off_now(FaultDevice device, Stamp now, std::string_view camera = {}) const noexcept;
  /// The remaining time of an active fault; a long time if it lasts for ever.
  Duration left(const FaultSpec& spec, Stamp now) const noexcept;

  /// What has begun and ended since the last call, in order of time.
  std::vector<FaultEvent> news(Stamp now);
  /// Names of the faults that have not begun yet.
  std::vector<std::string> waiting(Stamp now) const;

 private:
  static constexpr std::int64_t kNotYet = INT64_MAX;

  std::size_t index_of(const FaultSpec& spec) const noexcept {
    return static_cast<std::size_t>(&spec - plan_.faults.data());
  }

  const FaultPlan plan_;
  std::vector<std::atomic<std::int64_t>> zero_ns_;  // of each fault
  std::vector<std::uint8_t> told_;                  // 0 nothing, 1 begins, 2 ends
};

/// Every n-th message counts; the seed alone decides which are lost.
/// Threads: one.
/// RT: safe.
class FaultDice {
 public:
  bool strikes(const FaultSpec& spec) noexcept { return strikes(spec.seed, spec.ratio); }
  bool strikes(std::uint64_t seed, double ratio) noexcept { return fault_chance(seed, thrown_++) < ratio; }

 private:
  std::uint64_t thrown_ = 0;
};

}  // namespace tankrig::sim
