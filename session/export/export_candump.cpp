#include "session/export/export_candump.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "drivers/arm/joint_slot.hpp"
#include "drivers/can/can_log.hpp"
#include "drivers/can/can_timing.hpp"

namespace tankrig {
namespace {

std::uint8_t raw_current(double amperes) {
  const ArmScaling scaling = laboratory_scaling();
  const double raw = std::round((amperes - scaling.ampere_offset) / scaling.ampere_per_count);
  return static_cast<std::uint8_t>(std::clamp(raw, 0.0, 255.0));
}

can_frame frame_of(std::uint16_t id, const std::uint8_t* data, std::uint8_t length) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = length;
  std::memcpy(frame.data, data, length);
  return frame;
}

}  // namespace

std::string synthesised_candump(const std::vector<JointState>& joints, const ArmCanIds& ids, int bitrate,
                                const WallClock& clock) {
  std::string out;
  for (const JointState& state : joints) {
    std::int64_t wall_ns = clock.at(state.stamp);
    const auto put = [&](const can_frame& frame) {
      wall_ns += bits_duration(frame_bits(frame), bitrate).count();
      CanLogEntry entry;
      entry.wall_ns = wall_ns;
      entry.interface = kSynthesised;
      entry.frame.can_id = frame.can_id;
      entry.frame.len = frame.can_dlc;
      std::memcpy(entry.frame.data, frame.data, frame.can_dlc);
      append_line(entry, out);
      out += '\n';
    };
    const std::uint8_t master[3] = {0, 0, raw_current(state.current_a)};
    put(frame_of(ids.master, master, sizeof master));
    for (std::size_t j = 0; j < kJoints; ++j) {
      SensorSlot slot;
      slot.position = static_cast<std::uint16_t>(state.ticks[j]);
      const SlotBytes bytes = encode(slot);
      put(frame_of(ids.sensors[j], bytes.data(), static_cast<std::uint8_t>(bytes.size())));
    }
  }
  return out;
}

}  // namespace tankrig
