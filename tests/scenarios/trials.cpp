#include "tests/scenarios/trials.hpp"

#include <algorithm>
#include <cstdio>

#include "rig/plan/scan_settings.hpp"
#include "tests/scenarios/scenario.hpp"

namespace tankrig::scenarios {
namespace {

using namespace std::chrono_literals;
using D = sim::FaultDevice;
using K = sim::FaultKind;

constexpr Duration kOnWires = 1200ms;  // after the laser's first command a fault begins there: in the shorter sweep

constexpr char kDark[] = "beam not seen";
constexpr char kRepeats[] = "repeats its picture";
constexpr char kJumped[] = "its clock jumped";
constexpr char kRelay[] = "laser relay: read state";
constexpr char kNoRoom[] = "No space left on device";
constexpr char kBadDisk[] = "Input/output error";
constexpr char kDied[] = "supervisor: died";
constexpr char kHeartbeat[] = "heartbeat late";

constexpr Duration kOnItsWay = 50ms;         // switched, exchanged over the serial line and back, seen by the cycle
constexpr Duration kSilence = 250ms;         // the arm driver's silence_timeout_ms
constexpr Duration kThreeReadings = 40ms;    // `persists_samples`, at the serial line's 75 Hz
constexpr Duration kRelaySilence = 150ms;    // three attempts of 50 ms
constexpr Duration kContactsRead = 50ms;     // the relay's query_period_ms
constexpr Duration kAfterSwitching = 300ms;  // no frame testifies sooner
constexpr Duration kLitMock = 5100ms, kLitWire = 3800ms;  // the laser's command, from on to off
constexpr Duration kLightDueMock = 3700ms;                // the laser's first command to shine, from the start

/// What whoever says these words waits for.
std::optional<Duration> patience(std::string_view words, const Trial& trial) {
  const ScanSettings usual;
  const sim::FaultSpec& fault = trial.fault;
  const Duration testimony = usual.safety.beam.frames * from_seconds(usual.capture.frame_period);
  const Duration dark = (trial.place == Place::kMock ? kLitMock : kLitWire) - fault.at;
  const bool seen_lit = fault.device == D::kLaser;  // a box that tells the opposite contradicts the cameras at once
  // No cycle is stepped in virtual time while the supervisor hangs; a disk makes it hang at the next frame.
  const Duration hangs = fault.kind == K::kStuck ? fault.duration : fault.delay;
  const Duration held = trial.place == Place::kMock ? hangs : 0ms;
  const Duration next_frame = fault.device == D::kDisk ? from_seconds(usual.capture.frame_period) : 0ms;
  const struct {
    std::string_view words;
    Duration longest;
  } all[] = {
      {"arm silent", from_seconds(usual.control.feedback_timeout)},
      {"arm: silent", kSilence},
      {"repeats old readings", kSilence},
      {"following error",
       3 * from_seconds(usual.control.following_error_limit / usual.sweep.velocity)},  // an arm that creeps on
      {"joint limit", 0ms},
      {"joint too fast", 0ms},
      {"an encoder lost its reference", kThreeReadings},
      {"arm: bus-off", 0ms},
      {"arm: carrier lost", 0ms},
      {"arm: write set-points", 0ms},
      {"camera mono", from_seconds(usual.safety.camera_timeout)},
      {kDark, testimony},
      {kRepeats, testimony},
      {kJumped, from_seconds(usual.capture.frame_period)},
      {"stray beam", (seen_lit ? 0ms : dark) + kAfterSwitching + testimony},
      {kRelay, kRelaySilence},
      {"laser: on though not commanded", dark + from_seconds(usual.safety.laser_off_allowance)},
      {"laser: dark after its warm-up",
       kLightDueMock + from_seconds(usual.capture.laser_warm_up + usual.safety.laser_on_margin)},
      {"laser: switch", dark},
      {kHeartbeat, std::max(from_seconds(usual.control.heartbeat_timeout), held) + next_frame},
      {"interlock open", kContactsRead},
      {kNoRoom, 0ms},
      {kBadDisk, 0ms},
      {kDied, 0ms},
  };
  const auto* const found = std::ranges::find_if(all, [&](const auto& one) { return one.words == words; });
  return found == std::end(all) ? std::nullopt : std::optional(found->longest);
}

}  // namespace

std::optional<Duration> longest_detection(const Trial& trial) {
  constexpr std::string_view kOr = " or ";
  std::optional<Duration> longest;
  for (std::string_view rest = trial.must; !rest.empty();) {
    const std::string_view words = rest.substr(0, rest.find(kOr));
    longest = std::max(longest, patience(words, trial));
    rest.remove_prefix(std::min(rest.size(), words.size() + kOr.size()));
  }
  if (!longest) return {};
  const Duration comes_and_goes = trial.fault.kind == K::kIntermittent ? trial.fault.period : Duration{};
  return *longest + comes_and_goes + kOnItsWay;  // of the seed's periods the second is the first bad one
}

const char* to_string(Place place) {
  constexpr const char* kNames[] = {"mock", "can", "serial"};
  return kNames[static_cast<std::size_t>(place)];
}

std::string argument(const sim::FaultSpec& fault) {
  const sim::FaultSpec usual;
  std::string text;
  const auto add = [&text](const char* name, double value, const char* unit) {
    char part[64];
    std::snprintf(part, sizeof part, "%s%s %.4g%s", text.empty() ? "" : ", ", name, value, unit);
    text += part;
  };
  if (fault.ratio != usual.ratio) add("ratio", fault.ratio, "");
  if (fault.delay != usual.delay) add("delay", 1e3 * seconds(fault.delay), " ms");
  if (fault.jump != usual.jump) add("jump", 1e3 * seconds(fault.jump), " ms");
  if (fault.duration != usual.duration) add("for", 1e3 * seconds(fault.duration), " ms");
  if (fault.origin == sim::FaultOrigin::kStart) text += text.empty() ? "from the start" : ", from the start";
  return text;
}

std::vector<Trial> trials() {
  std::vector<Trial> all;
  for (const Scenario& s : scenarios()) {
    if (s.plan.faults.size() != 1 || s.plan.faults[0].origin == sim::FaultOrigin::kPhase || s.disk_kib > 0 ||
        s.file_kib > 0)
      continue;
    const sim::FaultSpec& fault = s.plan.faults[0];
    const auto& counts = s.expected.counts;
    const auto counted = std::ranges::find_if(counts, [](const auto& count) { return count.second.first > 0; });
    all.push_back(
        {Place::kMock, fault, s.expected.status, s.expected.lux, counted == counts.end() ? "" : counted->first});
    for (const Place place : {Place::kCan, Place::kSerial})
      if (const auto words = s.wires.find(to_string(place)); words != s.wires.end()) {
        all.push_back({place, fault, words->second, s.expected.lux, s.wires_counted});
        if (fault.origin == sim::FaultOrigin::kLaserOn) all.back().fault.at = kOnWires;
      }
  }
  return all;
}

}  // namespace tankrig::scenarios
