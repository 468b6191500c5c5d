// When an emulated GigE Vision camera exposes: on its own grid, or by the software triggers that reach it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include "core/time.hpp"
#include "sim_backends/wire/gige_registers.hpp"

namespace tankrig::sim {

/// Totals since construction, across unplugging.
struct GigeExposureCounts {
  std::atomic<std::uint64_t> made{0};
  std::atomic<std::uint64_t> skipped{0};  ///< times of the grid that passed while a picture was still made or sent
  std::atomic<std::uint64_t> ignored{0};  ///< software triggers of which no frame came
  std::atomic<std::uint64_t> next_index{0};
};

/// Exposures are on time however late their thread is. A free-running one ends on a multiple of the frame period of
/// CLOCK_MONOTONIC. A software trigger starts one when its command arrives, unless the camera is exposing, not armed,
/// or has `kMostTriggers` without a picture. What the client stops is abandoned.
/// Threads: next() in one, everything else in any.
class GigeExposures {
 public:
  static constexpr std::size_t kMostTriggers = 8;

  struct Exposure {
    std::uint64_t index = 0;
    Stamp begin{};
    Duration length{};
    std::uint64_t acquisition = 0;  ///< of which start
  };

  GigeExposures(const GigeRegisters& registers, GigeExposureCounts& counts) : registers_(registers), counts_(counts) {}

  /// The client has written to a register.
  void written(std::uint32_t address, std::uint32_t value, Stamp arrival);
  /// Waits until the next exposure is over. Nothing: end() was called.
  std::optional<Exposure> next();
  /// False if its client has stopped it meanwhile.
  bool wanted(const Exposure& exposure) const;
  void end();

 private:
  bool software_triggered() const;
  bool free_running() const;
  Duration exposure() const;
  /// Waits for `when`; false if anything changed before.
  bool reached(std::unique_lock<std::mutex>& lock, Stamp when);
  std::optional<Exposure> triggered(std::unique_lock<std::mutex>& lock);
  std::optional<Exposure> on_grid(std::unique_lock<std::mutex>& lock);
  Exposure made(Stamp begin, Duration length);

  const GigeRegisters& registers_;
  GigeExposureCounts& counts_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool acquiring_ = false, ending_ = false;
  std::uint64_t changes_ = 0, acquisition_ = 0;
  std::deque<Stamp> triggers_;
  Stamp exposing_until_{};
  std::optional<std::int64_t> last_on_grid_;  ///< in periods
};

}  // namespace tankrig::sim
