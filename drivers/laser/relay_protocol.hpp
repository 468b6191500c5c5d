// The bytes between the rig and the laser's supply relay.
#pragma once

#include <cstdint>
#include <optional>

namespace tankrig {

/// One byte switches, and is echoed. Defaults are those of the laboratory's public power box for the arm (9600 8N1, 1
/// on, 2 off, one byte read back; irs-ros-pkg, arm5_power_control). The status query is this project's assumption.
struct RelayProtocol {
  std::uint8_t on_byte = 1;
  std::uint8_t off_byte = 2;
  std::optional<std::uint8_t> status_query{};  ///< answered by relay_status_byte(); none: the box has no read-back

  std::uint8_t command(bool on) const noexcept { return on ? on_byte : off_byte; }
};

/// The box's answer to the status query: the real state of its contacts.
struct RelayStatus {
  bool closed = false;            ///< bit 0: the relay's contact
  bool interlock_closed = false;  ///< bit 1: the interlock's loop
  friend bool operator==(const RelayStatus&, const RelayStatus&) = default;
};

/// Bits 7 to 2 are 010100, so that no echo looks like a status.
constexpr std::uint8_t kRelayStatusMark = 0x50;

constexpr std::uint8_t relay_status_byte(RelayStatus status) noexcept {
  return static_cast<std::uint8_t>(kRelayStatusMark | (status.closed ? 1 : 0) | (status.interlock_closed ? 2 : 0));
}

/// Nothing if the byte is no status.
constexpr std::optional<RelayStatus> decode_relay_status(std::uint8_t byte) noexcept {
  if ((byte & 0xFC) != kRelayStatusMark) return std::nullopt;
  return RelayStatus{(byte & 1) != 0, (byte & 2) != 0};
}

}  // namespace tankrig
