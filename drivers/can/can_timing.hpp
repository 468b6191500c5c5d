// How long frames keep the bus busy.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <span>

#include "core/time.hpp"

namespace tankrig {

/// Bits of a classic frame from its start of frame to the end of the intermission, with the stuff bits of its content.
/// Layout, CRC-15 (polynomial 0x4599) and stuffing: Bosch CAN Specification 2.0 (1991), ISO 11898-1.
/// RT: safe.
int frame_bits(const can_frame& frame) noexcept;

/// The same at worst, for any content of `length` bytes: g + 8n + 13 + floor((g + 8n - 1) / 4) with g = 34 for 11-bit
/// and 54 for 29-bit identifiers: R. I. Davis, A. Burns, R. J. Bril, J. J. Lukkien, "Controller Area Network (CAN)
/// schedulability analysis: Refuted, revisited and revised", Real-Time Systems 35 (2007), equations 1 and 2.
constexpr int worst_frame_bits(int length, bool extended = false) noexcept {
  const int stuffed = (extended ? 54 : 34) + 8 * length;
  return stuffed + 13 + (stuffed - 1) / 4;
}

/// Rounded up to the nanosecond.
constexpr Duration bits_duration(std::int64_t bits, int bitrate) noexcept {
  return Duration{(bits * 1'000'000'000 + bitrate - 1) / bitrate};
}

/// Frames of one kind, sent repeatedly.
struct CanTraffic {
  double frames_per_s = 0;
  int length = 8;  ///< bytes
};

/// Worst-case share of the bus's time for 11-bit frames; above 1 they cannot be sent.
double bus_load(std::span<const CanTraffic> traffic, int bitrate) noexcept;

}  // namespace tankrig
