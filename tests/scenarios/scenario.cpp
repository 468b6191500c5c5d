#include "tests/scenarios/scenario.hpp"

#include <algorithm>
#include <cstdio>
#include <ostream>

#include "core/input_error.hpp"
#include "session/reading/session.hpp"

namespace tankrig::scenarios {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;

constexpr ConfigRange kWholeScan{1, 2000};  // cycles

Expected expected_from(const ConfigNode& node) {
  Expected e;
  e.status = node.text("status");
  if (node.has("tells")) e.tells = node.texts("tells");
  if (node.has("not_told")) e.not_told = node.texts("not_told");
  e.left = node.text_or("left", e.left);
  e.laser_off_cycles = static_cast<std::uint64_t>(node.integer_or("laser_off_cycles", 2, {0, 2}));
  e.arm_stop_cycles = static_cast<std::uint64_t>(node.integer_or("arm_stop_cycles", 1, {0, 1}));
  if (e.status != "complete") {
    e.fault_to_laser_off_cycles = static_cast<std::uint64_t>(node.integer("fault_to_laser_off_cycles", kWholeScan));
    e.fault_to_arm_stop_cycles = static_cast<std::uint64_t>(node.integer("fault_to_arm_stop_cycles", kWholeScan));
  }
  e.beam_left_on = node.flag_or("beam_left_on", false);
  e.lux = node.text_or("lux", "");
  e.frames = node.integer_or("frames", 0);
  if (const auto counts = node.optional_child("counts"))
    for (const std::string& name : counts->keys()) {
      const auto range = counts->numbers(name, 2);
      e.counts[name] = {static_cast<std::uint64_t>(range[0]), static_cast<std::uint64_t>(range[1])};
    }
  node.finish();
  return e;
}

void compare_times(const Expected& e, const Outcome& o, std::vector<std::string>& wrong) {
  const auto say = [&](const std::string& text) { wrong.push_back(text); };
  const Reaction& r = *o.reaction;
  if (!r.laser_first) say("the arm was stopped before the laser was off");
  if (r.laser_cycles > e.laser_off_cycles)
    say("laser off " + std::to_string(r.laser_cycles) + " cycles after detection, expected at most " +
        std::to_string(e.laser_off_cycles));
  if (r.arm_cycles > e.arm_stop_cycles)
    say("arm stopped " + std::to_string(r.arm_cycles) + " cycles after the laser, expected at most " +
        std::to_string(e.arm_stop_cycles));
  const auto late = [&](const char* what, Stamp when, std::uint64_t limit) {
    const double cycles = seconds(when - o.begun) / kCyclePeriod;
    if (cycles > static_cast<double>(limit) + 1e-6)
      say(std::string(what) + " " + std::to_string(cycles) + " cycles after the fault began, expected at most " +
          std::to_string(limit));
  };
  late("laser off", r.laser_off, e.fault_to_laser_off_cycles);
  late("arm stopped", r.arm_stop, e.fault_to_arm_stop_cycles);
}

void compare_session(const Scenario& s, const Outcome& o, const fs::path& path, std::vector<std::string>& wrong) {
  try {
    const Session session = Session::open(path);
    if (session.info.status == "complete" && o.stopped()) wrong.push_back("the session says complete");
    if (!o.stopped() && session.info.status != "complete") wrong.push_back("the session says " + session.info.status);
    for (const auto& [camera, account] : session.info.account)
      if (!account.closes())
        wrong.push_back("camera " + camera + ": " + account_line(session.info.counts, camera, account));
    if (std::ssize(session.frames) < s.expected.frames)
      wrong.push_back("the session holds " + std::to_string(session.frames.size()) + " frames, expected " +
                      std::to_string(s.expected.frames));
    for (const FrameRecord& frame : session.frames)
      if (session.image(frame).empty()) wrong.push_back("the session's " + frame.file + " is empty");
  } catch (const InputError& e) {
    wrong.push_back(std::string("the session does not open: ") + e.what());
  }
}

Scenario scenario_from(const std::string& name, const ConfigNode& node) {
  Scenario s;
  s.name = name;
  for (const char* told : {"goes_wrong", "must_happen"})
    if (node.text(told).empty()) node.fail(told, "expected a sentence");
  s.plan = sim::FaultPlan::from(node);
  s.disk_kib = node.integer_or("disk_kib", 0);
  s.file_kib = node.integer_or("file_kib", 0);
  if (node.has("picture_px")) {
    const auto size = node.numbers("picture_px", 2);
    s.picture = {static_cast<int>(size[0]), static_cast<int>(size[1])};
  }
  s.expected = expected_from(node.child("expected"));
  if (const auto wires = node.optional_child("wires")) {
    for (const char* carrier : {"can", "serial"})
      if (wires->has(carrier)) s.wires[carrier] = wires->text(carrier);
    s.wires_counted = wires->text_or("counted", "");
    wires->finish();
    if (s.plan.faults.size() != 1) node.fail("faults", "expected one, because it is played on wires too");
  }
  node.finish();
  return s;
}

}  // namespace

std::vector<Scenario> scenarios() {
  std::vector<Scenario> all;
  for (auto d = std::uint8_t{0}; d <= static_cast<std::uint8_t>(sim::FaultDevice::kSupervisor); ++d) {
    const ConfigNode table = ConfigNode::load(fs::path(TANKRIG_SOURCE_DIR) / "tests/scenarios" /
                                              (sim::to_string(static_cast<sim::FaultDevice>(d)) + ".yaml"s));
    for (const std::string& name : table.keys()) all.push_back(scenario_from(name, table.child(name)));
  }
  return all;
}

std::ostream& operator<<(std::ostream& out, const Scenario& scenario) { return out << scenario.name; }

std::vector<std::string> differences(const Scenario& s, const Outcome& o, const fs::path& session) {
  std::vector<std::string> wrong;
  const Expected& e = s.expected;
  const bool as_said = e.status == "complete" ? o.status == e.status : o.status.find(e.status) != std::string::npos;
  if (!as_said) wrong.push_back("status: found \"" + o.status + "\", expected \"" + e.status + "\"");
  for (const std::string& words : e.tells)
    if (!o.told(words)) wrong.push_back("nobody said \"" + words + "\"");
  for (const std::string& words : e.not_told)
    if (o.told(words)) wrong.push_back("somebody said \"" + words + "\"");
  if (to_string(o.left) != e.left)
    wrong.push_back("left: found \"" + to_string(o.left) + "\", expected \"" + e.left + "\"");
  if (o.lux.find(e.lux) == std::string::npos) wrong.push_back("lux meter: found \"" + o.lux + "\", expected " + e.lux);
  for (const auto& [name, range] : e.counts) {
    const auto it = o.counts.find(name);
    const std::uint64_t found = it == o.counts.end() ? 0 : it->second;
    if (found < range.first || found > range.second)
      wrong.push_back(name + ": found " + std::to_string(found) + ", expected " + std::to_string(range.first) + " to " +
                      std::to_string(range.second));
  }
  if (o.left.laser_dark && o.beam_left_on != e.beam_left_on)
    wrong.push_back(o.beam_left_on ? "the beam is on at the end" : "the beam is off at the end");
  if (!o.has_begun) wrong.push_back("the fault never began");
  if (o.stopped() && o.has_begun) {
    if (o.reaction)
      compare_times(e, o, wrong);
    else
      wrong.push_back("laser and arm were not both commanded off");
  }
  compare_session(s, o, session, wrong);
  return wrong;
}

std::string summary(const Outcome& o) {
  char line[400];
  if (o.reaction)
    std::snprintf(line, sizeof line,
                  "detected %.0f ms after it began, laser off %llu cycles later, arm stopped %llu cycles later; ",
                  1e3 * seconds(o.reaction->detected - o.begun),
                  static_cast<unsigned long long>(o.reaction->laser_cycles),
                  static_cast<unsigned long long>(o.reaction->arm_cycles));
  else
    std::snprintf(line, sizeof line, "%s", "");
  std::string text = line + o.status + "; " + to_string(o.left) + "; lux meter: " + o.lux;
  for (const auto& [name, count] : o.counts)
    if (count > 0) text += "; " + name + " " + std::to_string(count);
  return text;
}

}  // namespace tankrig::scenarios
