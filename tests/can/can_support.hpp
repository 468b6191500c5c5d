// What the CAN tests share: frames, waiting with a deadline, raw datagrams, a hub in a folder of its own.
#pragma once

#include <gtest/gtest.h>
#include <linux/can.h>
#include <poll.h>
#include <sys/socket.h>

#include <chrono>
#include <initializer_list>
#include <optional>
#include <string>
#include <thread>

#include "core/clock.hpp"
#include "drivers/can/can_carrier.hpp"
#include "drivers/can/open_can.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig::can_test {

inline CanFrame frame_of(std::uint16_t id, std::initializer_list<std::uint8_t> bytes = {}) {
  CanFrame f;
  f.id = id;
  for (const std::uint8_t b : bytes) f.data[f.length++] = b;
  return f;
}

inline CanFrame numbered(std::uint16_t id, std::uint32_t number) {
  return frame_of(id, {std::uint8_t(number), std::uint8_t(number >> 8), std::uint8_t(number >> 16),
                       std::uint8_t(number >> 24), 0x55, 0xAA, 0x00, 0xFF});
}

inline std::uint32_t number_of(const CanFrame& f) {
  return f.data[0] | f.data[1] << 8 | f.data[2] << 16 | static_cast<std::uint32_t>(f.data[3]) << 24;
}

inline can_frame raw_frame(canid_t id, std::initializer_list<std::uint8_t> bytes = {}) {
  can_frame f{};
  f.can_id = id;
  for (const std::uint8_t b : bytes) f.data[f.can_dlc++] = b;
  return f;
}

/// An error frame: eight bytes of which data[`at`] is `value`.
inline can_frame raw_error(canid_t classes, int at = 0, std::uint8_t value = 0) {
  can_frame f{};
  f.can_id = CAN_ERR_FLAG | classes;
  f.can_dlc = 8;
  f.data[at] = value;
  return f;
}

inline bool send_raw(int descriptor, const void* bytes, std::size_t size) {
  return ::send(descriptor, bytes, size, MSG_NOSIGNAL) == static_cast<ssize_t>(size);
}
inline bool send_raw(int descriptor, const can_frame& f) { return send_raw(descriptor, &f, sizeof f); }

/// True as soon as `condition` holds; false after a time no healthy machine needs.
template <class Condition>
bool eventually(Condition condition, std::chrono::milliseconds limit = std::chrono::seconds(20)) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  return true;
}

/// The next frame, waited for.
inline std::optional<CanFrame> next_frame(CanBus& bus, std::chrono::milliseconds limit = std::chrono::seconds(20)) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < deadline) {
    const auto r = bus.try_receive();
    if (r.ok() && r.value()) return r.value();
    pollfd p{bus.descriptor(), POLLIN, 0};
    ::poll(&p, 1, 5);
  }
  return std::nullopt;
}

/// The next frame, waited for; a failure, and an identifier no frame has, if none comes.
inline CanFrame must_hear(CanBus& bus) {
  const auto f = next_frame(bus);
  EXPECT_TRUE(f) << "no frame came";
  return f.value_or(CanFrame{0xFFFF, 0, {}, {}});
}

/// Sends though the queue may be full for a while.
inline bool send_all_the_same(CanBus& bus, const CanFrame& frame) {
  return eventually([&] { return bus.try_send(frame).ok(); });
}

/// Reads until nothing waits; what came is thrown away.
inline void digest(CanBus& bus) {
  while (true) {
    const auto r = bus.try_receive();
    if (!r.ok() || !r.value()) return;
  }
}

}  // namespace tankrig::can_test
