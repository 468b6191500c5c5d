#include "tests/scenarios/verdict.hpp"

#include <algorithm>
#include <cstdio>

namespace tankrig::scenarios {
namespace {

using D = sim::FaultDevice;
using K = sim::FaultKind;

std::string ms(Duration time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f ms", 1e3 * seconds(time));
  return text;
}

bool ended_early(const Outcome& o) { return !o.has_begun || (o.reaction && o.reaction->detected < o.begun); }

bool ended_as(const std::string& must, const std::string& status) {
  constexpr std::string_view kOr = " or ";
  const auto next = must.find(kOr);
  const std::string words = must.substr(0, next);
  if (words == "complete" ? status == words : status.find(words) != std::string::npos) return true;
  return next != std::string::npos && ended_as(must.substr(next + kOr.size()), status);
}

struct Reach {
  bool off_byte = true, contact = true, arm = true;
};

/// What a command can still do on the wire.
Reach reach(const sim::FaultSpec& fault) {
  const auto is = [&](D device, std::initializer_list<K> kinds) {
    return fault.device == device && std::find(kinds.begin(), kinds.end(), fault.kind) != kinds.end();
  };
  return {.off_byte = !is(D::kLaser, {K::kUnplugged}),
          .contact = !is(D::kLaser, {K::kUnplugged, K::kOff, K::kStuck}),
          .arm = !is(D::kArm, {K::kOff, K::kBusOff, K::kEnobufs, K::kUnplugged})};
}

std::string late_command(const Reaction& r) {
  if (r.laser_cycles > 2) return "laser off commanded " + std::to_string(r.laser_cycles) + " cycles after detection";
  if (r.arm_cycles > 1) return "arm stopped " + std::to_string(r.arm_cycles) + " cycles after the laser";
  return "";
}

std::string late_on_wire(const char* what, std::optional<Stamp> when, Stamp detected, Duration longest) {
  if (!when) return std::string(what) + " never";
  if (*when - detected > longest) return std::string(what) + " " + ms(*when - detected) + " after detection";
  return "";
}

std::string late_detection(const Row& row) {
  const auto longest = longest_detection(row.trial);
  if (!longest) return "";
  const Duration took = row.outcome.reaction->detected - row.outcome.begun;
  return took > *longest ? "detected " + ms(took) + " after it began, at most " + ms(*longest) + " allowed" : "";
}

std::string late_on_wires(const Row& row) {
  const WireMarks& w = *row.wire;
  const Reach can = reach(row.trial.fault);
  if (can.off_byte && !w.off_byte) return "the line's last command does not say off";
  if (!w.cut || !w.last_edge) return "the watchdog box was never closed";
  if (*w.cut - *w.last_edge > kBoxOpens)
    return "contactors open " + ms(*w.cut - *w.last_edge) + " after the box's last edge";
  if (w.rested_after > kArmAlone) return "the arm moves " + ms(*w.rested_after) + " after the scan";
  if (!row.outcome.reaction) return "";
  const Stamp detected = row.outcome.reaction->detected;
  std::string why;
  if (can.off_byte) why = late_on_wire("off byte", w.off_byte, detected, kOnTheWire);
  if (why.empty() && can.contact) why = late_on_wire("contact open", w.opened, detected, kOnTheWire);
  if (why.empty() && can.arm) why = late_on_wire("demand for rest", w.rest, detected, kOnTheWire);
  return why;
}

/// What depends on time: whether the fault, and not a device that had none, ended the scan, and how soon.
std::string unlike_its_trial(const Row& row) {
  const Outcome& o = row.outcome;
  const Trial& t = row.trial;
  if (ended_early(o)) return "ended before the fault began";
  if (!ended_as(t.must, o.status)) return (o.stopped() ? "" : "not detected: ") + ("expected \"" + t.must + "\"");
  std::string why;
  if (o.reaction) why = late_detection(row);
  if (o.reaction && why.empty()) why = late_command(*o.reaction);
  if (why.empty() && row.wire) why = late_on_wires(row);
  if (!why.empty()) return why;
  if (row.wire && !o.stamp_error) return "of no recorded frame it is known when it was exposed";
  if (o.lux.find(t.lux) == std::string::npos) return "lux meter: found \"" + o.lux + "\", expected \"" + t.lux + "\"";
  if (const auto count = o.counts.find(t.counted);
      !t.counted.empty() && (count == o.counts.end() || count->second == 0))
    return t.counted + " is 0";
  return "";
}

/// What nobody's lateness excuses: something is left on, or said to be safe that is not.
std::string unsafe(const Row& row) {
  const Outcome& o = row.outcome;
  if (o.stopped() && o.has_begun && !o.reaction) return "laser and arm were not both commanded off";
  if (o.reaction && !o.reaction->laser_first) return "the arm was stopped before the laser was off";
  const auto stuck = [&](D device) { return row.trial.fault.device == device && row.trial.fault.kind == K::kStuck; };
  if (o.left.laser_dark && row.wire && row.wire->contact_closed) return "said to be off, but the contact is closed";
  if (row.wire && row.wire->contact_closed && reach(row.trial.fault).contact) return "the contact is closed";
  if (row.wire && row.wire->fed) return "the watchdog box is closed";
  if (row.wire && !row.wire->rested_after) return "the arm moves";
  if (o.left.laser_dark && o.beam_left_on && !stuck(D::kBeam)) return "said to be off, but the beam is on";
  if (!o.left.arm_at_rest) return "";
  if (o.moving > 0.01) return "said to be at rest, but moves";
  return stuck(D::kArm) ? "said to be at rest by readings that repeat" : "";
}

/// Likewise: what is recorded is what it says, and what is not recorded has a reason.
std::string untrue(const Row& row) {
  const Outcome& o = row.outcome;
  for (const auto& [camera, account] : o.account)
    if (!account.closes())
      return "the account is open: camera " + camera + ": " + account_line(o.counts, camera, account);
  if (o.has_begun && o.account.empty()) return "there is no account of frames";
  if (o.stamp_error > kStampError) return "a frame is recorded whose stamp is wrong by " + ms(*o.stamp_error);
  return "";
}

}  // namespace

std::string broken(const Row& row) {
  std::string why = unsafe(row);
  if (why.empty()) why = untrue(row);
  return why.empty() && !too_late(row) ? unlike_its_trial(row) : why;
}

}  // namespace tankrig::scenarios
