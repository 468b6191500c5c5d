#include "drivers/can/can_socket.hpp"

#include <linux/sock_diag.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "drivers/can/can_datagram.hpp"

namespace tankrig {
namespace {

constexpr const char* kSend = "can: send";
constexpr const char* kReceive = "can: receive";

bool put(int descriptor, const CanFrame& frame) noexcept {
  can_frame raw{};
  raw.can_id = frame.id;
  raw.can_dlc = frame.length;
  std::copy_n(frame.data.begin(), frame.length, raw.data);
  return ::send(descriptor, &raw, sizeof raw, MSG_DONTWAIT | MSG_NOSIGNAL) >= 0;
}

}  // namespace

CanSocket::CanSocket(CanCarrier carrier, const CanSettings& settings, const Clock& clock)
    : carrier_(std::move(carrier)),
      filters_(settings.filters),
      reopen_period_(settings.reopen_period),
      clock_(clock),
      stamps_(clock),
      state_(carrier_.first_state()) {}

Status CanSocket::try_send(const CanFrame& frame) noexcept {
  if (frame.id > CAN_SFF_MASK || frame.length > CAN_MAX_DLEN)
    return Error{ErrorCode::kOutOfRange, 0, clock_.now(), "can: send: id above 0x7FF or more than 8 bytes"};
  if (away()) return missing(kSend);
  if (!put(carrier_.descriptor(), frame)) {
    const int error = errno;
    if (error != ENOBUFS && error != EAGAIN) return lost(error, kSend);
    add(send_buffer_full_);
    return Error{ErrorCode::kRefused, ENOBUFS, clock_.now(), "can: send: queue full"};
  }
  if (state() == CanState::kBusOff)
    return Error{
        ErrorCode::kNotReady, 0, clock_.now(),
        carrier_.restarts() ? "can: send: bus-off" : "can: send: bus-off: ip link set INTERFACE type can restart"};
  add(sent_);
  return {};
}

void CanSocket::send_regardless(const CanFrame& frame) noexcept { put(carrier_.descriptor(), frame); }

/// What the kernel still charges the socket for.
bool CanSocket::waits() const noexcept {
  std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
  socklen_t size = sizeof memory;
  return ::getsockopt(carrier_.descriptor(), SOL_SOCKET, SO_MEMINFO, memory.data(), &size) == 0 &&
         memory[SK_MEMINFO_WMEM_ALLOC] > 0;
}

Result<std::optional<CanFrame>> CanSocket::try_receive() noexcept {
  // What was received before the interface went away is still delivered.
  for (int i = 0; i < kLook && descriptor() >= 0; ++i) {
    const CanDatagram datagram = receive_datagram(carrier_.descriptor());
    if (datagram.bytes < 0) {
      // A peer that closed with frames unread resets once; what it sent before still waits.
      if (datagram.error == EINTR || datagram.error == ECONNRESET) continue;
      if (datagram.error == EAGAIN) break;
      return lost(datagram.error, kReceive);
    }
    if (datagram.bytes == 0 && at_end(carrier_.descriptor())) return lost(ECONNRESET, kReceive);
    if (datagram.drops)
      receive_dropped_.fetch_add(*datagram.drops - std::exchange(drops_told_, *datagram.drops),
                                 std::memory_order_relaxed);
    if (!datagram.classic()) {
      add(foreign_);
    } else if (datagram.frame.can_id & CAN_ERR_FLAG) {
      take_error_frame(datagram.frame);
    } else if (!accepts(datagram.frame.can_id)) {
      add(foreign_);
    } else {
      if (state() == CanState::kBusOff) set_state(CanState::kErrorActive);
      add(received_);
      CanFrame frame;
      frame.id = static_cast<std::uint16_t>(datagram.frame.can_id);
      frame.length = datagram.frame.len;
      std::copy_n(datagram.frame.data, frame.length, frame.data.begin());
      frame.stamp = stamps_(datagram.wall);
      return std::optional{frame};
    }
  }
  if (away()) return missing(kReceive);
  return std::optional<CanFrame>{};
}

bool CanSocket::accepts(canid_t id) const noexcept {
  if (id & ~CAN_SFF_MASK) return false;
  return filters_.empty() || std::any_of(filters_.begin(), filters_.end(),
                                         [id](const CanFilter& f) { return ((id ^ f.id) & f.mask) == 0; });
}

void CanSocket::take_error_frame(const canfd_frame& frame) noexcept {
  can_frame classic{};
  classic.can_id = frame.can_id;
  classic.can_dlc = frame.len;
  std::copy_n(frame.data, frame.len, classic.data);
  const CanErrorReport report = decode_error_frame(classic);
  add(error_frames_);
  if (report.bus_off) add(bus_off_);
  if (report.restarted) add(restarted_);
  if (report.no_ack) add(no_ack_);
  if (report.lost_arbitration) add(lost_arbitration_);
  if (report.bus_error) add(bus_errors_);
  if (report.transmit_timeout) add(send_timeouts_);
  if (report.receive_overflow || report.transmit_overflow) add(controller_overflow_);
  if (!report.state || away()) return;
  if (state() == CanState::kBusOff && !report.restarted) return;
  set_state(*report.state);
}

Error CanSocket::lost(int error, const char* where) noexcept {
  if (error == ENETDOWN) {
    set_state(CanState::kDown);
  } else if (error == ENODEV || error == ENXIO || error == EPIPE || error == ECONNRESET || error == ENOTCONN) {
    closed_ = error != ENODEV && error != ENXIO;  // an interface that is unplugged is not
    set_state(CanState::kGone);
  } else {
    return {ErrorCode::kIo, error, clock_.now(), where};
  }
  last_look_ = clock_.now();
  return missing(where);
}

Error CanSocket::missing(const char* where) const noexcept {
  return {ErrorCode::kDisconnected, state() == CanState::kDown ? ENETDOWN : ENODEV, clock_.now(), where};
}

Status CanSocket::reopen() noexcept {
  constexpr const char* kWhere = "can: look for the interface";
  if (!away()) return {};
  const Stamp now = clock_.now();
  if (now - last_look_ < reopen_period_) return Error{ErrorCode::kNotReady, 0, now, kWhere};
  last_look_ = now;
  if (std::exchange(closed_, false)) carrier_.lose();
  switch (carrier_.look()) {
    case CanCarrier::Presence::kUp:
      set_state(CanState::kErrorActive);
      add(reopened_);
      break;
    case CanCarrier::Presence::kDown:
      set_state(CanState::kDown);
      break;
    case CanCarrier::Presence::kGone:
      set_state(CanState::kGone);
      break;
  }
  if (away()) return Error{ErrorCode::kNotReady, 0, now, kWhere};
  return {};
}

CanCounters CanSocket::counters() const noexcept {
  const auto read = [](const Count& count) { return count.load(std::memory_order_relaxed); };
  CanCounters c;
  c.sent = read(sent_);
  c.received = read(received_);
  c.send_buffer_full = read(send_buffer_full_);
  c.receive_dropped = read(receive_dropped_);
  c.error_frames = read(error_frames_);
  c.bus_off = read(bus_off_);
  c.no_ack = read(no_ack_);
  c.foreign = read(foreign_);
  c.reopened = read(reopened_);
  c.restarted = read(restarted_);
  c.lost_arbitration = read(lost_arbitration_);
  c.bus_errors = read(bus_errors_);
  c.send_timeouts = read(send_timeouts_);
  c.controller_overflow = read(controller_overflow_);
  return c;
}

}  // namespace tankrig
