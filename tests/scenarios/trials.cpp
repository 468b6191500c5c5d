#include "tests/scenarios/trials.hpp"

#include <algorithm>
#include <cstdio>

#include "rig/plan/scan_settings.hpp"

namespace tankrig::scenarios {
namespace {

using namespace std::chrono_literals;
using D = sim::FaultDevice;
using K = sim::FaultKind;

constexpr Duration kMockAt = 2s, kWireAt = 1200ms;  // after the laser's first command: in the sweep

struct Argument {
  double ratio = -1;  // below 0: the plan's default; so are times of 0
  Duration delay{}, duration{}, jump{};
  bool from_start = false;
};

struct Case {
  D device;
  K kind;
  Argument argument;
  const char *mock, *can, *serial;  // what must come of it there; null: no trial
  const char* lux = "";
  const char* counted = "";
};

constexpr char kDone[] = "complete";
constexpr char kDark[] = "beam not seen";
constexpr char kRepeats[] = "repeats its picture";
constexpr char kJumped[] = "its clock jumped";
constexpr char kRelay[] = "laser relay: read state";
constexpr char kNoRoom[] = "No space left on device";
constexpr char kBadDisk[] = "Input/output error";
constexpr char kDied[] = "supervisor: died";
constexpr char kHeartbeat[] = "heartbeat late";
constexpr char kSilent[] = "arm: silent or arm silent";  // by the driver, or by the cycle that had no news
constexpr char kNone[] = "";

// clang-format off
constexpr Case kCases[] = {
    {D::kArm, K::kOff,          {}, "arm silent", kSilent, kSilent},
    {D::kArm, K::kStuck,        {}, "following error", "repeats old readings", "repeats old readings"},
    {D::kArm, K::kGarbage,      {}, "joint limit", kDone, "complete or repeats old readings"},
    {D::kArm, K::kWrong,        {}, "joint too fast", "an encoder lost its reference", "an encoder lost its reference"},
    {D::kArm, K::kSlow,         {.ratio = 0.1}, "following error", "following error", "following error"},
    {D::kArm, K::kDelayed,      {.delay = 400ms}, "arm silent", kSilent, kSilent},
    {D::kArm, K::kIntermittent, {}, "arm silent", kSilent, kSilent},
    {D::kArm, K::kBusOff,       {}, "arm: bus-off", "arm: bus-off", nullptr},
    {D::kArm, K::kEnobufs,      {}, "arm silent", kSilent, nullptr},
    {D::kArm, K::kUnplugged,    {}, "arm: carrier lost", kSilent, "arm: carrier lost"},
    {D::kArm, K::kDropped,      {.ratio = 0.05}, kDone, kDone, kDone},
    {D::kArm, K::kDropped,      {.ratio = 1}, "arm silent", kSilent, kSilent},
    {D::kArm, K::kTorn,         {}, kDone, kSilent, kSilent},
    {D::kArm, K::kClockJump,    {}, "following error", nullptr, nullptr},
    {D::kArm, K::kWriteError,   {}, "arm: write set-points", nullptr, nullptr},
    {D::kCamera, K::kOff,          {}, "camera mono", "camera mono", "camera mono"},
    {D::kCamera, K::kStuck,        {}, kRepeats, kRepeats, kRepeats},
    {D::kCamera, K::kGarbage,      {}, kDark, kDark, kDark},
    {D::kCamera, K::kWrong,        {}, kDark, kDark, kDark},
    {D::kCamera, K::kSlow,         {.delay = 400ms, .duration = 100ms}, kHeartbeat, nullptr, nullptr},
    {D::kCamera, K::kDelayed,      {.delay = 30ms}, kDone, kDone, nullptr},
    {D::kCamera, K::kIntermittent, {}, "camera mono", "camera mono", "camera mono"},
    {D::kCamera, K::kUnplugged,    {}, "camera mono", "camera mono", "camera mono"},
    {D::kCamera, K::kDropped,      {.ratio = 0.05}, kDone, nullptr, nullptr, kNone, "mono.lost"},
    {D::kCamera, K::kDropped,      {.ratio = 0.05}, nullptr, kDone, nullptr, kNone, "mono.incomplete"},  // packets, not frames
    {D::kCamera, K::kTorn,         {}, "camera mono", "camera mono", "camera mono", kNone, "mono.incomplete"},
    {D::kCamera, K::kClockJump,    {}, kJumped, kDone, nullptr},
    {D::kCamera, K::kClockJump,    {.jump = -500ms}, kJumped, kDone, nullptr},
    {D::kCamera, K::kClockJump,    {.jump = -30ms}, nullptr, kDone, nullptr, kNone, "mono.clock_unsure"},  // less than a frame's period
    {D::kLaser, K::kOff,          {}, kRelay, kRelay, kRelay},
    {D::kLaser, K::kStuck,        {}, "laser: on though not commanded", "laser: on though not commanded", "laser: on though not commanded"},
    {D::kLaser, K::kGarbage,      {}, kRelay, kRelay, kRelay},
    {D::kLaser, K::kWrong,        {}, "stray beam", kRelay, kRelay},
    {D::kLaser, K::kSlow,         {.delay = 2s, .from_start = true}, "laser: dark after its warm-up", nullptr, nullptr},
    {D::kLaser, K::kDelayed,      {}, "laser: on though not commanded", kRelay, kRelay},
    {D::kLaser, K::kIntermittent, {}, kRelay, kRelay, kRelay},
    {D::kLaser, K::kUnplugged,    {}, kRelay, kRelay, kRelay},
    {D::kLaser, K::kDropped,      {.ratio = 1, .from_start = true}, "laser: dark after its warm-up", nullptr, nullptr},
    {D::kLaser, K::kDropped,      {.ratio = 1}, "laser: on though not commanded", nullptr, nullptr},
    {D::kLaser, K::kWriteError,   {}, "laser: switch", nullptr, nullptr},
    {D::kBeam, K::kOff,          {}, kDark, kDark, kDark},
    {D::kBeam, K::kStuck,        {}, "stray beam", "stray beam", "stray beam"},
    {D::kBeam, K::kIntermittent, {}, kDark, kDark, kDark},
    {D::kLuxMeter, K::kOff,          {}, kDone, kDone, nullptr, "no answer"},
    {D::kLuxMeter, K::kStuck,        {}, kDone, kDone, nullptr, "60.0"},
    {D::kLuxMeter, K::kGarbage,      {}, kDone, kDone, nullptr, "protocol error"},
    {D::kLuxMeter, K::kWrong,        {}, kDone, kDone, nullptr, "72.0"},
    {D::kLuxMeter, K::kSlow,         {}, kDone, kDone, nullptr, "60.0"},
    {D::kLuxMeter, K::kIntermittent, {.ratio = 1}, kDone, kDone, nullptr, "no answer"},
    {D::kLuxMeter, K::kUnplugged,    {}, kDone, kDone, nullptr, "disconnected"},
    {D::kLuxMeter, K::kTorn,         {}, kDone, kDone, nullptr, "protocol error"},
    {D::kInterlock, K::kOff,          {}, "interlock open", "interlock open", "interlock open"},
    {D::kInterlock, K::kIntermittent, {}, "interlock open", "interlock open", "interlock open"},
    {D::kDisk, K::kDiskFull,   {}, kNoRoom, kNoRoom, kNoRoom},
    {D::kDisk, K::kWriteError, {}, kBadDisk, kBadDisk, kBadDisk},
    {D::kDisk, K::kSlow,       {.duration = 1s}, kHeartbeat, kHeartbeat, kHeartbeat},
    {D::kDisk, K::kStuck,      {.duration = 1s}, kHeartbeat, kHeartbeat, kHeartbeat},
    {D::kSupervisor, K::kOff,   {}, kDied, kDied, kDied},
    {D::kSupervisor, K::kStuck, {.duration = 1s}, kHeartbeat, kHeartbeat, kHeartbeat},
    {D::kSupervisor, K::kSlow,  {.duration = 1s}, kHeartbeat, kHeartbeat, kHeartbeat},
};
// clang-format on

sim::FaultSpec fault_of(const Case& c, Place place) {
  sim::FaultSpec s;
  s.device = c.device;
  s.kind = c.kind;
  s.origin = c.argument.from_start ? sim::FaultOrigin::kStart : sim::FaultOrigin::kLaserOn;
  if (!c.argument.from_start) s.at = place == Place::kMock ? kMockAt : kWireAt;
  if (c.device == D::kCamera) s.camera = "mono";
  if (c.argument.ratio >= 0) s.ratio = c.argument.ratio;
  if (c.argument.delay.count() > 0) s.delay = c.argument.delay;
  if (c.argument.jump.count() != 0) s.jump = c.argument.jump;
  s.duration = c.argument.duration;
  return s;
}

const char* must(const Case& c, Place place) {
  return place == Place::kMock ? c.mock : place == Place::kCan ? c.can : c.serial;
}

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
  const Duration testimony = usual.safety.beam.frames * from_seconds(usual.frame_period);
  const Duration dark = (trial.place == Place::kMock ? kLitMock : kLitWire) - fault.at;
  const bool seen_lit = fault.device == D::kLaser;  // a box that tells the opposite contradicts the cameras at once
  // No cycle is stepped in virtual time while the supervisor hangs; a disk makes it hang at the next frame.
  const Duration hangs = fault.kind == K::kStuck ? fault.duration : fault.delay;
  const Duration held = trial.place == Place::kMock ? hangs : 0ms;
  const Duration next_frame = fault.device == D::kDisk ? from_seconds(usual.frame_period) : 0ms;
  const struct {
    std::string_view words;
    Duration longest;
  } all[] = {
      {"arm silent", from_seconds(usual.feedback_timeout)},
      {"arm: silent", kSilence},
      {"repeats old readings", kSilence},
      {"following error",
       3 * from_seconds(usual.following_error_limit / usual.sweep_velocity)},  // an arm that creeps on
      {"joint limit", 0ms},
      {"joint too fast", 0ms},
      {"an encoder lost its reference", kThreeReadings},
      {"arm: bus-off", 0ms},
      {"arm: carrier lost", 0ms},
      {"arm: write set-points", 0ms},
      {"camera mono", from_seconds(usual.safety.camera_timeout)},
      {kDark, testimony},
      {kRepeats, testimony},
      {kJumped, from_seconds(usual.frame_period)},
      {"stray beam", (seen_lit ? 0ms : dark) + kAfterSwitching + testimony},
      {kRelay, kRelaySilence},
      {"laser: on though not commanded", dark + from_seconds(usual.safety.laser_off_allowance)},
      {"laser: dark after its warm-up",
       kLightDueMock + from_seconds(usual.laser_warm_up + usual.safety.laser_on_margin)},
      {"laser: switch", dark},
      {kHeartbeat, std::max(from_seconds(usual.heartbeat_timeout), held) + next_frame},
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
  for (const Case& c : kCases)
    for (const Place place : {Place::kMock, Place::kCan, Place::kSerial})
      if (must(c, place)) all.push_back({place, fault_of(c, place), must(c, place), c.lux, c.counted});
  return all;
}

}  // namespace tankrig::scenarios
