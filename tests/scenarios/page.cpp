#include "tests/scenarios/page.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>

namespace tankrig::scenarios {
namespace {

constexpr char kHeading[] = R"md(# What a fault does, measured
Made by `cmake --build build --target reliability && build/tests/scenarios/reliability --lanes 2 docs/measured/reliability.md`, every line of
it, in one run of five minutes; exit code 0 if no row is wrong. Every fault of every device that offers it
(docs/reference/faults.md) begins in the sweep with the laser on, unless its row says otherwise, with the defaults of a fault plan
but for what its row names.

* `mock`: the small rig of tests/scenarios in virtual time, cycle 200 Hz; the same figures on every machine. Its devices
  have no wires.
* `can`, `serial`: real drivers on emulated wires in real time, the arm on that carrier, one CLOCK_MONOTONIC for drivers
  and emulators. %MACHINE%

| column | | must be |
|---|---|---|
| must | words of the status that the scan must end with (one of them, where there are several); `complete`: it must not be stopped | found |
| within | the bound of the next column: the time-out of whoever must notice it, and what the fault takes to show [ms] | |
| detected | from the fault's begin until a call failed or the scan said so [ms] | at most `within` |
| off, cycles | steps of the executive from detection to the command that switches the laser off | at most 2 |
| off, command | the same [ms] | |
| off, byte | from detection until the relay's line had the byte that says off [ms] | at most %WIRE% |
| relay open | from detection until its contact opened [ms] | at most %WIRE%, where a command can reach it |
| stop, cycles | steps from the laser's command to the arm's, which comes strictly later | at most 1 |
| stop | from detection until the arm was commanded to rest (mock), or had the demand for rest on its wire [ms] | at most %WIRE% |
| box open | from the last heartbeat edge that the watchdog box had until both contactors were open, after the scan or in it [ms] | at most %BOX% |
| machine late | see below [ms] | at most %LATE%, else the row is not judged |
| lost | frames that were taken and are not in the session, by reason | with those recorded: all that were to come |
| session, left | the session's status, and what the devices themselves confirmed at the end | true of the devices; never "at rest" by readings that repeat |
| tries | how often it was made, whatever came of it | 1 |
| verdict | ok, or what is wrong | ok |

On wires each recorded frame's stamp is held against its exposure, which its picture tells: off by at most %STAMP%.

"machine late" is what a thread on each processor that only looks at the clock and passes a byte through a pseudo-terminal
was late at most in that scan. Beyond its bound the times tell of the machine and not of the drivers: the row says "not
judged", and is wrong only if something was left on or said to be safe that was not, a frame is missing without a reason,
or one is recorded with a wrong stamp. It is not made again.

"before": before detection already, because the laser's driver drops the command by itself or the sweep was over.
"never": it did not get one. "-": there is nothing to measure.

On wires relay and arm have no watchdogs of their own: none is known of the real arm. A watchdog box
(docs/reference/watchdog_box.md) feeds both. After every scan its contactors are open, so that there is no light, and the arm is
at rest, also where a command could not reach them.

)md";

constexpr char kTableHead[] =
    "| device | fault | on | must | within | detected | off, cycles | off, command | off, byte | relay open | stop, "
    "cycles | "
    "stop | box open | machine late | lost | session, left | tries | verdict |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

constexpr char kElsewhere[] = R"(
## What has no row
Cameras on wires are GigE Vision. Emulated Video for Linux cameras need a kernel with loop-back video devices, which the
guest of tests/kernel has; what a cut or a stall does to their driver is tested on a scripted device (tests/camera). The
lux meter on wires is the PCE-174: that one and the T-10A are read after the scan by the same interface, on the same kind
of line; the T-10A's faults are in tests/serial.

| device | fault | on | n/a: because |
|---|---|---|---|
)";

void replace(std::string& text, const std::string& name, const std::string& value) {
  for (auto at = text.find(name); at != std::string::npos; at = text.find(name, at + value.size()))
    text.replace(at, name.size(), value);
}

std::string in_ms(Duration time) { return std::to_string(time / std::chrono::milliseconds{1}) + " ms"; }

/// Frames that were taken and are not in the session, by reason.
std::string lost(const Outcome& o) {
  std::string text;
  for (const auto& [name, count] : o.counts) {
    const std::string reason = name.substr(name.find('.') + 1);
    if (count == 0 || name.starts_with("cycle.") || name.starts_with("sync.") || reason == "recorded" ||
        reason == "not_recorded")
      continue;
    text += (text.empty() ? "" : ", ") + name + " " + std::to_string(count);
  }
  return text.empty() ? "0" : text;
}

/// Without what differs from run to run or would end a cell.
std::string cell(std::string text) {
  std::ranges::replace(text, '|', '/');
  std::ranges::replace(text, '\n', ' ');
  const std::string temporary = std::filesystem::temp_directory_path().string();
  if (const auto at = text.find(temporary); at != std::string::npos) {
    const auto end = text.find(": ", at);
    text.erase(at, end == std::string::npos ? end : end + 2 - at);
  }
  return text;
}

constexpr char kTries[] = "1";

std::string in_ms(Duration time, int decimals) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", decimals, 1e3 * seconds(time));
  return text;
}

/// `late`: 0 where the machine was not too late.
std::string verdict_cells(const std::string& why, Duration late = {}) {
  const std::string verdict = !why.empty()        ? "**" + cell(why) + "**"
                              : late > Duration{} ? "not judged: machine late by " + in_ms(late, 1) + " ms"
                                                  : "ok";
  return std::string(" | ") + kTries + " | " + verdict + " |\n";
}

std::string beginning(const Trial& t) {
  const std::string how = argument(t.fault);
  const auto within = longest_detection(t);
  return std::string("| ") + sim::to_string(t.fault.device) + " | " + sim::to_string(t.fault.kind) +
         (how.empty() ? "" : ", " + how) + " | " + to_string(t.place) + " | " + t.must + " | " +
         (within ? std::to_string(*within / std::chrono::milliseconds{1}) : "-") + " | ";
}

std::string times(const Row& row) {
  if (!row.outcome.reaction) return "- | - | - | - | - | - | -";
  const Reaction& r = *row.outcome.reaction;
  return after(r.detected, row.outcome.begun) + " | " + std::to_string(r.laser_cycles) + " | " +
         after(r.laser_off, r.detected) + " | " +
         (row.wire ? after(row.wire->off_byte, r.detected) + " | " + after(row.wire->opened, r.detected) : "- | -") +
         " | " + std::to_string(r.arm_cycles) + " | " +
         after(row.wire ? row.wire->rest : std::optional(r.arm_stop), r.detected);
}

/// Of what the watchdog box saw; "-" without one.
template <class Marks>
std::string box_open(const Marks& marks) {
  return marks && marks->last_edge ? after(marks->cut, *marks->last_edge) : "-";
}

}  // namespace

std::string after(std::optional<Stamp> when, Stamp since) {
  if (!when) return "never";
  if (*when < since) return "before";
  return in_ms(*when - since, 1);
}

std::string page_heading(const std::string& machine) {
  std::string text = kHeading;
  replace(text, "%MACHINE%", machine);
  replace(text, "%WIRE%", in_ms(kOnTheWire));
  replace(text, "%BOX%", in_ms(kBoxOpens));
  replace(text, "%LATE%", in_ms(kBearable));
  replace(text, "%STAMP%", in_ms(kStampError));
  return text + kTableHead;
}

std::string page_row(const Row& row, const std::string& why) {
  const Outcome& o = row.outcome;
  const std::string late = row.wire ? in_ms(row.wire->machine_late, 1) : "-";
  const bool lux_says = row.trial.fault.device == sim::FaultDevice::kLuxMeter;
  return beginning(row.trial) + times(row) + " | " + box_open(row.wire) + " | " + late + " | " + lost(o) + " | " +
         cell(o.status) + "; " + to_string(o.left) + (lux_says ? "; reading: " + cell(o.lux) : "") +
         verdict_cells(why, too_late(row) ? row.wire->machine_late : Duration{});
}

std::string page_row(const Trial& trial, const std::string& why) {
  return beginning(trial) + "- | - | - | - | - | - | - | - | - | - | -" + verdict_cells(why);
}

std::string page_absences() {
  struct Line {
    std::string device, where, reason, kinds;
  };
  std::vector<Line> lines;
  for (const Absence& a : absences()) {
    const auto same = std::ranges::find_if(lines, [&](const Line& l) {
      return l.device == sim::to_string(a.device) && l.where == a.where && l.reason == a.reason;
    });
    if (same == lines.end())
      lines.push_back({sim::to_string(a.device), a.where, a.reason, sim::to_string(a.kind)});
    else
      same->kinds += std::string(", ") + sim::to_string(a.kind);
  }
  std::string text = kElsewhere;
  for (const Line& l : lines)
    text += "| " + l.device + " | " + l.kinds + " | " + l.where + " | " +
            (l.reason.empty() ? "**no reason**" : l.reason) + " |\n";
  return text;
}

std::string page_killed_heading() {
  const auto bound = [](Ending ending) {
    return in_ms(*bounds(ending).off_byte) + " and " + in_ms(*bounds(ending).rest);
  };
  return "\n## The scanning process dies or stands still\nNeither laser nor arm has a watchdog here: none is known of "
         "the "
         "real arm. The scan's guardian (docs/reference/safety.md) switches the\nlaser off, then brings the arm to "
         "rest. "
         "Times are "
         "from the signal, at most a cycle (5 ms) after the last completed safety step.\n\n* Bounds of off byte and "
         "rest: " +
         bound(Ending::kKilled) +
         ", which is 100 and 150 ms after that step. Of a killed guardian, which the scan\n  notices: " +
         bound(Ending::kGuardianKilled) + ". After pulled lines are back: " + bound(Ending::kLinesPulled) +
         ".\n* Box open: from its last heartbeat edge, at most " + in_ms(kBoxOpens) +
         ", whoever is left.\n* Killed for want of memory: its control group is killed at once, as the out-of-memory "
         "killer does to a "
         "group.\n* A scan that stood still goes on once laser and arm are safe. It must light and move nothing more, "
         "and "
         "end.\n* Killed with its guardian: nobody is left but the box, and no byte may have come after 3 s.\n\n"
         "| the scan is | carrier | off byte [ms] | rest [ms] | box open [ms] | machine late [ms] | tries | verdict |\n"
         "|---|---|---|---|---|---|---|---|\n";
}

std::string page_killed_row(const std::string& carrier, const Killed& k, const std::string& why) {
  const std::string beginning = std::string("| ") + to_string(k.ending) + " | " + carrier + " | ";
  if (!k.skipped.empty()) return beginning + "- | - | - | - | 0 | not made: " + cell(k.skipped) + " |\n";
  return beginning + after(k.off_byte, k.when) + " | " + after(k.rest, k.when) + " | " + box_open(std::optional(k)) +
         " | " + in_ms(k.machine_late, 1) + verdict_cells(why, too_late(k) ? k.machine_late : Duration{});
}

std::string page_killed_row(const std::string& carrier, Ending ending, const std::string& why) {
  return std::string("| ") + to_string(ending) + " | " + carrier + " | - | - | - | -" + verdict_cells(why);
}

}  // namespace tankrig::scenarios
