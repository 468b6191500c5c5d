#include "sim_backends/faults/fault_plan.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>

#include "core/input_error.hpp"

namespace tankrig::sim {
namespace {

using D = FaultDevice;
using K = FaultKind;

constexpr std::array kDevices{"arm", "camera", "laser", "beam", "lux_meter", "interlock", "disk", "supervisor"};
constexpr std::array kKinds{"off",     "stuck",        "garbage",    "wrong",     "slow",
                            "delayed", "intermittent", "bus_off",    "enobufs",   "unplugged",
                            "dropped", "torn",         "clock_jump", "disk_full", "write_error"};
constexpr std::array kOrigins{"start", "motion", "laser_on", "phase"};

// clang-format off
constexpr FaultOffer kOffers[] = {
    //                        mock   wire
    {D::kArm, K::kOff,           true,  true,  "no supply: axes rest, no answer; on the wire the encoders begin at 0 again"},
    {D::kArm, K::kStuck,         true,  true,  "repeats its last readings with fresh stamps, and moves on"},
    {D::kArm, K::kGarbage,       true,  true,  "mock: random angles, some no numbers; wire: noise before every answer"},
    {D::kArm, K::kWrong,         true,  true,  "the elbow reads `amount` radians too much"},
    {D::kArm, K::kSlow,          true,  true,  "moves at `ratio` of the speed it says it applies"},
    {D::kArm, K::kDelayed,       true,  true,  "readings arrive `delay_s` late"},
    {D::kArm, K::kIntermittent,  true,  true,  "no answers in a share `ratio` of the periods of `period_s`"},
    {D::kArm, K::kBusOff,        true,  true,  "its host's CAN controller is off the bus"},
    {D::kArm, K::kEnobufs,       true,  true,  "the send queue is full: nothing goes out, so nothing comes back"},
    {D::kArm, K::kUnplugged,     true,  true,  "no carrier; a CAN cable that is cut acknowledges nothing"},
    {D::kArm, K::kDropped,       true,  true,  "a share `ratio` of the answers is lost"},
    {D::kArm, K::kTorn,          true,  true,  "mock: some joints' readings are old; wire: answers are cut off"},
    {D::kArm, K::kClockJump,     true,  false, "stamps are `jump_s` later than they should be"},
    {D::kArm, K::kWriteError,    true,  false, "set-points and stop are refused with EIO"},
    {D::kCamera, K::kOff,          true, true,  "sends no frames"},
    {D::kCamera, K::kStuck,        true, true,  "the same picture again and again, with fresh stamps"},
    {D::kCamera, K::kGarbage,      true, true,  "noise instead of a picture"},
    {D::kCamera, K::kWrong,        true, true,  "a black picture, as with a lens cap on"},
    {D::kCamera, K::kSlow,         true, false, "every call of its driver takes `delay_s`"},
    {D::kCamera, K::kDelayed,      true, true,  "frames are handed over `delay_s` late, rightly stamped"},
    {D::kCamera, K::kIntermittent, true, true,  "no frames in a share `ratio` of the periods of `period_s`"},
    {D::kCamera, K::kUnplugged,    true, true,  "vanishes"},
    {D::kCamera, K::kDropped,      true, true,  "mock: a share `ratio` of the frames is lost; wire: of the packets"},
    {D::kCamera, K::kTorn,         true, true,  "frames come incomplete"},
    {D::kCamera, K::kClockJump,    true, true,  "its clock jumps by `jump_s`"},
    {D::kLaser, K::kOff,          true, true,  "the relay's box is dead: no answer; its contact opens by its watchdog"},
    {D::kLaser, K::kStuck,        true, true,  "the relay has welded: it does not open"},
    {D::kLaser, K::kGarbage,      true, true,  "noise before every answer"},
    {D::kLaser, K::kWrong,        true, true,  "mock: reads back the opposite; wire: echoes another byte"},
    {D::kLaser, K::kSlow,         true, false, "shines `delay_s` later than its warm-up promises"},
    {D::kLaser, K::kDelayed,      true, true,  "obeys (wire: answers) `delay_s` late"},
    {D::kLaser, K::kIntermittent, true, true,  "no answers in a share `ratio` of the periods of `period_s`"},
    {D::kLaser, K::kUnplugged,    true, true,  "the serial line is gone; the contact opens by its watchdog"},
    {D::kLaser, K::kDropped,      true, false, "a share `ratio` of the commands has no effect"},
    {D::kLaser, K::kWriteError,   true, false, "every command is refused with EIO"},
    {D::kBeam, K::kOff,          true, true,  "no light, though relay and read-back say on"},
    {D::kBeam, K::kStuck,        true, true,  "light, though relay and read-back say off"},
    {D::kBeam, K::kIntermittent, true, true,  "no light in a share `ratio` of the periods of `period_s`"},
    {D::kLuxMeter, K::kOff,          true, true,  "no answer"},
    {D::kLuxMeter, K::kStuck,        true, true,  "the same reading again and again"},
    {D::kLuxMeter, K::kGarbage,      true, true,  "noise instead of an answer"},
    {D::kLuxMeter, K::kWrong,        true, true,  "reads 1 + `amount` times the truth"},
    {D::kLuxMeter, K::kSlow,         true, true,  "answers after `delay_s`"},
    {D::kLuxMeter, K::kIntermittent, true, true,  "no answers in a share `ratio` of the periods of `period_s`"},
    {D::kLuxMeter, K::kUnplugged,    true, true,  "the serial line is gone"},
    {D::kLuxMeter, K::kTorn,         true, true,  "answers are cut off"},
    {D::kInterlock, K::kOff,          true, true, "the loop opens"},
    {D::kInterlock, K::kIntermittent, true, true, "a bad contact: open in a share `ratio` of the periods of `period_s`"},
    {D::kDisk, K::kDiskFull,   true, false, "every write finds no space"},
    {D::kDisk, K::kWriteError, true, false, "every write finds an I/O error"},
    {D::kDisk, K::kSlow,       true, false, "every frame takes `delay_s` to be written"},
    {D::kDisk, K::kStuck,      true, false, "the next frame hangs until the fault is over"},
    {D::kSupervisor, K::kOff,   true, false, "the loop beside the cycle dies of an exception"},
    {D::kSupervisor, K::kStuck, true, false, "it hangs until the fault is over"},
    {D::kSupervisor, K::kSlow,  true, false, "each of its rounds takes `delay_s` longer"},
};
// clang-format on

template <class Enum, std::size_t N>
Enum chosen(const std::array<const char*, N>& names, const std::string& name) {
  return static_cast<Enum>(std::find(names.begin(), names.end(), name) - names.begin());
}

template <std::size_t N>
std::vector<std::string> words(const std::array<const char*, N>& names) {
  return {names.begin(), names.end()};
}

bool offered(const FaultOffer& offer, FaultLevel level) { return level == FaultLevel::kMock ? offer.mock : offer.wire; }

const FaultOffer* offer_of(FaultDevice device, FaultKind kind) {
  for (const FaultOffer& offer : kOffers)
    if (offer.device == device && offer.kind == kind) return &offer;
  return nullptr;
}

template <class Good>
std::string offers_of(FaultDevice device, Good good) {
  std::string list;
  for (const FaultOffer& offer : kOffers)
    if (offer.device == device && good(offer)) list += (list.empty() ? "" : ", ") + std::string(to_string(offer.kind));
  return list.empty() ? "nothing" : list;
}

/// "camera", "cameras" and "camera NAME" beside the plain names.
FaultDevice device_from(const ConfigNode& node, std::string& camera) {
  std::string text = node.text("device");
  constexpr std::string_view kCamera = "camera ";
  if (text.starts_with(kCamera)) {
    camera = text.substr(kCamera.size());
    text = "camera";
  }
  if (std::find(kDevices.begin(), kDevices.end(), text) == kDevices.end()) {
    std::string list;
    for (const char* name : kDevices) list += (list.empty() ? "" : ", ") + std::string(name);
    node.fail("device", "found '" + text + "', expected one of: " + list + " (camera NAME: that one only)");
  }
  return chosen<FaultDevice>(kDevices, text);
}

FaultSpec spec_from(const ConfigNode& node) {
  const auto time = [&](const char* key, Duration fallback) {
    return from_seconds(node.number_or(key, seconds(fallback), {0, 1e6}));
  };
  FaultSpec s;
  s.device = device_from(node, s.camera);
  s.kind = chosen<FaultKind>(kKinds, node.choice("kind", words(kKinds)));
  if (!offer_of(s.device, s.kind))
    node.fail("kind", "found '" + std::string(to_string(s.kind)) + "', which " + to_string(s.device) +
                          " does not offer; it offers: " + offers_of(s.device, [](const FaultOffer&) { return true; }));
  s.origin =
      chosen<FaultOrigin>(kOrigins, node.choice_or("from", node.has("phase") ? "phase" : "start", words(kOrigins)));
  s.phase = node.text_or("phase", "");
  if ((s.origin == FaultOrigin::kPhase) == s.phase.empty())
    node.fail("from", "expected `phase: NAME` with `from: phase`, and only then");
  s.at = time("at_s", s.at);
  s.duration = time("duration_s", s.duration);
  s.ratio = node.number_or("ratio", s.ratio, {0, 1});
  s.period = from_seconds(node.number_or("period_s", seconds(s.period), {1e-3, 1e4}));
  s.delay = time("delay_s", s.delay);
  s.amount = node.number_or("amount", s.amount, {-100, 100});
  s.jump = from_seconds(node.number_or("jump_s", seconds(s.jump), {-1e6, 1e6}));
  s.seed = static_cast<std::uint64_t>(node.number_or("seed", 1, {0, 9e15}));
  node.finish();
  return s;
}

}  // namespace

const char* to_string(FaultDevice device) noexcept { return kDevices[static_cast<std::size_t>(device)]; }
const char* to_string(FaultKind kind) noexcept { return kKinds[static_cast<std::size_t>(kind)]; }

std::span<const FaultOffer> fault_offers() noexcept { return kOffers; }

std::string FaultSpec::name() const {
  return std::string(to_string(device)) + (camera.empty() ? "" : " " + camera) + ": " + to_string(kind);
}

FaultPlan FaultPlan::load(const std::filesystem::path& file) {
  const ConfigNode root = ConfigNode::load(file);
  FaultPlan plan = from(root);
  root.finish();
  return plan;
}

FaultPlan FaultPlan::load(const std::filesystem::path& file, FaultLevel level,
                          const std::vector<std::string>& cameras) {
  FaultPlan plan = load(file);
  try {
    plan.check(level);
  } catch (const InputError& e) {
    throw InputError(file, e.what());
  }
  std::string list;
  for (const std::string& camera : cameras) list += (list.empty() ? "" : ", ") + camera;
  for (const FaultSpec& s : plan.faults)
    if (!s.camera.empty() && std::find(cameras.begin(), cameras.end(), s.camera) == cameras.end())
      throw InputError(file, "faults: " + s.name() + ": found a camera '" + s.camera + "', expected one of: " + list);
  return plan;
}

FaultPlan FaultPlan::from(const ConfigNode& node) {
  FaultPlan plan;
  for (const ConfigNode& item : node.items("faults")) plan.faults.push_back(spec_from(item));
  return plan;
}

void FaultPlan::check(FaultLevel level) const {
  const auto here = [&](const FaultOffer& offer) { return offered(offer, level); };
  const std::string where = level == FaultLevel::kMock ? "mock rig" : "emulated wire";
  for (const FaultSpec& s : faults) {
    if (const FaultOffer* offer = offer_of(s.device, s.kind); !offer || !here(*offer))
      throw InputError("faults: " + s.name() + ": not to be had on the " + where + "; " + to_string(s.device) +
                       " offers there: " + offers_of(s.device, here));
    if (level == FaultLevel::kWire && s.origin == FaultOrigin::kPhase)
      throw InputError("faults: " + s.name() +
                       ": an emulated wire knows no phases; count from start, motion or laser_on");
  }
}

std::string FaultPlan::yaml() const {
  YAML::Emitter out;
  out.SetDoublePrecision(9);
  out << YAML::BeginMap << YAML::Key << "faults" << YAML::Value << YAML::BeginSeq;
  for (const FaultSpec& s : faults) {
    const auto write = [&](const char* key, const auto& value) { out << YAML::Key << key << YAML::Value << value; };
    out << YAML::Flow << YAML::BeginMap;
    write("device", std::string(to_string(s.device)) + (s.camera.empty() ? "" : " " + s.camera));
    write("kind", to_string(s.kind));
    write("from", kOrigins[static_cast<std::size_t>(s.origin)]);
    if (!s.phase.empty()) write("phase", s.phase);
    write("at_s", seconds(s.at));
    write("duration_s", seconds(s.duration));
    write("ratio", s.ratio);
    write("period_s", seconds(s.period));
    write("delay_s", seconds(s.delay));
    write("amount", s.amount);
    write("jump_s", seconds(s.jump));
    write("seed", s.seed);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
  return out.c_str() + std::string("\n");
}

double fault_chance(std::uint64_t seed, std::uint64_t number) noexcept {
  std::uint64_t z = seed * 0x9e3779b97f4a7c15U + (number + 1) * 0xd1342543de82ef95U;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

}  // namespace tankrig::sim
