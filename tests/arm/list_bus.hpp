// A CAN bus made of two lists.
#pragma once

#include <cerrno>
#include <deque>
#include <vector>

#include "drivers/can/can_bus.hpp"

namespace tankrig::testing_support {

/// Takes `room` frames, then is full.
class ListBus final : public CanBus {
 public:
  Status try_send(const CanFrame& frame) noexcept override {
    if (sent.size() >= room) return Error{ErrorCode::kRefused, ENOBUFS, {}, "can: send: queue full"};
    sent.push_back(frame);
    return {};
  }
  void send_regardless(const CanFrame& frame) noexcept override { sent.push_back(frame); }
  Result<std::optional<CanFrame>> try_receive() noexcept override {
    if (waiting.empty()) return std::optional<CanFrame>{};
    const CanFrame frame = waiting.front();
    waiting.pop_front();
    return std::optional<CanFrame>(frame);
  }
  CanState state() const noexcept override { return CanState::kErrorActive; }
  CanCounters counters() const noexcept override { return {}; }
  Status reopen() noexcept override { return {}; }
  int descriptor() const noexcept override { return -1; }

  std::deque<CanFrame> waiting;
  std::vector<CanFrame> sent;
  std::size_t room = 1000;
};

}  // namespace tankrig::testing_support
