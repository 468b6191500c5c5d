// Why some devices know no such fault.
#include <algorithm>

#include "tests/scenarios/trials.hpp"

namespace tankrig::scenarios {
namespace {

using D = sim::FaultDevice;
using K = sim::FaultKind;

struct Reason {
  D device;
  std::vector<K> kinds;
  const char* text;
};

constexpr char kNoMessages[] = "one contact, open or closed: it sends no messages";
constexpr char kLight[] = "light is there or not: off, stuck, intermittent";
constexpr char kPlugged[] = "no plug between it and the host: off";
constexpr char kLoop[] = "a loop of this program: all it gives the cycle is its heartbeat, which comes, late, or not";

/// Of what is offered nowhere.
const std::vector<Reason>& not_offered() {
  static const std::vector<Reason> table = {
      {D::kCamera, {K::kWriteError}, "nothing is written to it in a sweep"},
      {D::kLaser, {K::kTorn}, "commands and answers are one byte each"},
      {D::kLaser, {K::kClockJump}, "its answers carry no time"},
      {D::kBeam, {K::kGarbage, K::kWrong, K::kDropped, K::kTorn, K::kClockJump, K::kWriteError}, kLight},
      {D::kBeam, {K::kSlow, K::kDelayed}, "late light is `laser slow`, a late command `laser delayed`"},
      {D::kBeam, {K::kUnplugged}, "a diode without supply is off"},
      {D::kLuxMeter, {K::kDelayed}, "a late answer is slow"},
      {D::kLuxMeter, {K::kDropped}, "one question, one answer: a lost one is off"},
      {D::kLuxMeter, {K::kClockJump}, "its answers carry no time"},
      {D::kLuxMeter, {K::kWriteError}, "a question that cannot be written is unplugged"},
      {D::kInterlock, {K::kStuck}, "a bridged contact cannot be told from a lid that is shut: nothing in the rig can"},
      {D::kInterlock, {K::kGarbage, K::kWrong, K::kDropped, K::kTorn, K::kClockJump, K::kWriteError}, kNoMessages},
      {D::kInterlock, {K::kSlow, K::kDelayed}, "it is read with the relay's state: `laser delayed`"},
      {D::kInterlock, {K::kUnplugged}, "a loop that is cut is open: off"},
      {D::kDisk, {K::kOff, K::kUnplugged, K::kIntermittent}, "the first write that fails ends the scan: write_error"},
      {D::kDisk,
       {K::kGarbage, K::kWrong, K::kDropped, K::kTorn},
       "what is on the disk is not read in a scan: `session check` finds it (tests/session)"},
      {D::kDisk, {K::kDelayed}, "a late write is slow"},
      {D::kDisk, {K::kClockJump}, "its answers carry no time"},
      {D::kSupervisor, {K::kGarbage, K::kWrong, K::kIntermittent, K::kDropped, K::kTorn, K::kClockJump}, kLoop},
      {D::kSupervisor, {K::kDelayed}, "a late round is slow"},
      {D::kSupervisor, {K::kUnplugged}, kPlugged},
      {D::kSupervisor, {K::kWriteError}, "what it writes goes to the disk: `disk write_error`"},
  };
  return table;
}

/// Of what is offered by the mocks only.
const std::vector<Reason>& not_on_wires() {
  static const std::vector<Reason> table = {
      {D::kArm, {K::kClockJump}, "no stamps on its wires: the host gives them"},
      {D::kArm, {K::kWriteError}, "a wire that takes nothing is unplugged, bus_off or enobufs"},
      {D::kCamera, {K::kSlow}, "bytes on a wire cannot make a call of the driver take longer"},
      {D::kLaser, {K::kSlow}, "the box tells its contact, not the light: light that is missing is `beam off`"},
      {D::kLaser, {K::kDropped}, "a command that is lost has no echo: intermittent"},
      {D::kLaser, {K::kWriteError}, "a line that takes nothing is unplugged"},
  };
  return table;
}

/// Of what is tried with the arm on CAN only.
const std::vector<Reason>& not_on_serial() {
  static const std::vector<Reason> table = {
      {D::kArm, {K::kBusOff, K::kEnobufs}, "a serial line has neither"},
      {D::kCamera, {K::kDelayed, K::kDropped}, "nothing stops, so the carrier's timing changes nothing"},
      {D::kCamera, {K::kClockJump}, "found at the first frame, whatever carries the arm"},
      {D::kLuxMeter,
       {K::kOff, K::kStuck, K::kGarbage, K::kWrong, K::kSlow, K::kIntermittent, K::kUnplugged, K::kTorn},
       "read after the scan, with the arm at rest on either carrier"},
  };
  return table;
}

std::string reason_in(const std::vector<Reason>& table, D device, K kind) {
  for (const Reason& reason : table)
    if (reason.device == device && std::ranges::find(reason.kinds, kind) != reason.kinds.end()) return reason.text;
  return "";
}

std::string why_not_offered(D device, K kind) {
  if (kind == K::kBusOff || kind == K::kEnobufs) return "not on the CAN bus";
  if (kind == K::kDiskFull) return "has no disk";
  return reason_in(not_offered(), device, kind);
}

}  // namespace

std::vector<Absence> absences() {
  const std::vector<Trial> tried = trials();
  const auto is_tried = [&](D device, K kind, Place place) {
    return std::ranges::any_of(
        tried, [&](const Trial& t) { return t.fault.device == device && t.fault.kind == kind && t.place == place; });
  };
  std::vector<Absence> all;
  for (auto d = std::uint8_t{0}; d <= static_cast<std::uint8_t>(D::kSupervisor); ++d)
    for (auto k = std::uint8_t{0}; k <= static_cast<std::uint8_t>(K::kWriteError); ++k) {
      const auto device = static_cast<D>(d);
      const auto kind = static_cast<K>(k);
      const auto offer = std::ranges::find_if(
          sim::fault_offers(), [&](const sim::FaultOffer& o) { return o.device == device && o.kind == kind; });
      if (offer == sim::fault_offers().end()) {
        all.push_back({device, kind, "anywhere", why_not_offered(device, kind)});
        continue;
      }
      if (!is_tried(device, kind, Place::kMock))
        all.push_back({device, kind, "mock", offer->mock ? "" : "not offered by the mocks"});
      const bool on_can = is_tried(device, kind, Place::kCan);
      if (!on_can) all.push_back({device, kind, "can, serial", reason_in(not_on_wires(), device, kind)});
      if (on_can && !is_tried(device, kind, Place::kSerial))
        all.push_back({device, kind, "serial", reason_in(not_on_serial(), device, kind)});
    }
  return all;
}

}  // namespace tankrig::scenarios
