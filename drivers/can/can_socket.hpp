// A node of a CAN bus on a descriptor that carries `struct can_frame`: the same code for every carrier.
#pragma once

#include <linux/can.h>

#include <atomic>
#include <vector>

#include "drivers/can/can_carrier.hpp"
#include "drivers/can/can_error.hpp"
#include "drivers/can/kernel_stamp.hpp"
#include "drivers/can/open_can.hpp"

namespace tankrig {

/// A bus-off ends with the kernel's restart (restart-ms, or `ip link set can0 type can restart`), with the interface
/// set down and up, or with the first frame received.
/// Threads: one at a time; state(), counters() and send_regardless() any.
/// RT: all but the constructor and reopen().
class CanSocket final : public CanBus {
 public:
  CanSocket(CanCarrier carrier, const CanSettings& settings, const Clock& clock);

  Status try_send(const CanFrame& frame) noexcept override;
  void send_regardless(const CanFrame& frame) noexcept override;
  bool waits() const noexcept override;
  /// Skips at most kLook frames for other nodes, then returns nothing, though more may wait.
  Result<std::optional<CanFrame>> try_receive() noexcept override;
  CanState state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  CanCounters counters() const noexcept override;
  /// At most every reopen_period of the settings.
  Status reopen() noexcept override;
  int descriptor() const noexcept override { return closed_ ? -1 : carrier_.descriptor(); }

  static constexpr int kLook = 256;

 private:
  using Count = std::atomic<std::uint64_t>;

  bool accepts(canid_t id) const noexcept;
  void take_error_frame(const canfd_frame& frame) noexcept;
  void set_state(CanState state) noexcept { state_.store(state, std::memory_order_relaxed); }
  bool away() const noexcept { return state() == CanState::kDown || state() == CanState::kGone; }
  Error lost(int error, const char* where) noexcept;
  Error missing(const char* where) const noexcept;
  static void add(Count& count) noexcept { count.fetch_add(1, std::memory_order_relaxed); }

  CanCarrier carrier_;
  std::vector<CanFilter> filters_;
  Duration reopen_period_;
  const Clock& clock_;
  StampConverter stamps_;
  Stamp last_look_{};
  bool closed_ = false;  ///< by the other side; here by reopen()
  std::uint32_t drops_told_ = 0;
  std::atomic<CanState> state_;
  Count sent_{0}, received_{0}, send_buffer_full_{0}, receive_dropped_{0}, error_frames_{0}, bus_off_{0}, no_ack_{0},
      foreign_{0}, reopened_{0}, restarted_{0}, lost_arbitration_{0}, bus_errors_{0}, send_timeouts_{0},
      controller_overflow_{0};
};

}  // namespace tankrig
