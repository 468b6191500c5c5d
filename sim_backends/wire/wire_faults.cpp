#include "sim_backends/wire/wire_faults.hpp"

#include "core/clock.hpp"
#include "sim_backends/wire/wire_priority.hpp"

namespace tankrig::sim {
namespace {

using D = FaultDevice;
using K = FaultKind;

constexpr Duration kLook = std::chrono::milliseconds{2};
constexpr int kArmNode = 0;

}  // namespace

WireFaults::WireFaults(FaultScript& script, WireDevices devices) : script_(script), devices_(std::move(devices)) {
  thread_ = std::thread([this] { run(); });
}

WireFaults::~WireFaults() {
  ends_ = true;
  thread_.join();
}

void WireFaults::run() {
  set_fifo("wire-faults", kEmulatedWirePriority);
  MonotonicClock clock;
  while (!ends_) {
    mark();
    const Stamp now = clock.now();
    if (devices_.arm) play_arm(now);
    if (devices_.hub) play_bus(now);
    play_laser(now);
    if (devices_.lux) play_lux(now);
    play_cameras(now);
    clock.sleep_until(now + kLook);
  }
}

void WireFaults::mark() {
  if (devices_.arm)
    if (const auto moved = devices_.arm->first_motion()) script_.mark(FaultOrigin::kMotion, *moved);
  if (devices_.relay)
    if (const auto lit = devices_.relay->first_on()) script_.mark(FaultOrigin::kLaserOn, *lit);
}

bool WireFaults::changed(const std::string& what, double value) {
  const auto [it, fresh] = applied_.try_emplace(what, 0.0);
  if (it->second == value) return false;
  it->second = value;
  return true;
}

void WireFaults::play_arm(Stamp now) {
  ArmEmulatorFaults f;
  const bool off = on(D::kArm, K::kOff, now);
  f.silent = off || script_.off_now(D::kArm, now);
  f.stale = on(D::kArm, K::kStuck, now);
  f.garbage = on(D::kArm, K::kGarbage, now);
  f.truncated = on(D::kArm, K::kTorn, now);
  if (const FaultSpec* s = script_.active(D::kArm, K::kWrong, now)) f.elbow_offset = s->amount;
  if (const FaultSpec* s = script_.active(D::kArm, K::kSlow, now)) f.speed = s->ratio;
  if (const FaultSpec* s = script_.active(D::kArm, K::kDelayed, now)) f.delay = s->delay;
  if (const FaultSpec* s = script_.active(D::kArm, K::kDropped, now)) f.lose = s->ratio;
  devices_.arm->set_faults(f);
  if (changed("arm off", off)) devices_.arm->power_cycle();
  const bool pulled = on(D::kArm, K::kUnplugged, now);
  if (pull(*devices_.arm, "arm", pulled) && devices_.hub) devices_.hub->cut(kArmNode, pulled);
}

/// Bus-off concerns everybody but the arm and those who only listen.
void WireFaults::play_bus(Stamp now) {
  const bool jammed = on(D::kArm, K::kEnobufs, now);
  if (changed("bus jammed", jammed)) devices_.hub->jam(jammed);
  const FaultSpec* off = script_.active(D::kArm, K::kBusOff, now);
  if (!changed("bus off", off != nullptr) || !off) return;
  for (const CanNodeReport& node : devices_.hub->report().nodes)
    if (node.number != kArmNode && !node.listens_only)
      devices_.hub->bus_off(node.number,
                            off->duration.count() > 0 ? std::optional(script_.left(*off, now)) : std::nullopt);
}

void WireFaults::play_laser(Stamp now) {
  if (devices_.laser) {
    const bool dark = on(D::kBeam, K::kOff, now) || script_.off_now(D::kBeam, now);
    devices_.laser->set_beam(dark                           ? MockBeam::kDark
                             : on(D::kBeam, K::kStuck, now) ? MockBeam::kStuck
                                                            : MockBeam::kTrue);
  }
  if (!devices_.relay) return;
  RelayEmulator& relay = *devices_.relay;
  RelayFault fault = RelayFault::kNone;
  if (on(D::kLaser, K::kGarbage, now)) fault = RelayFault::kGarbage;
  if (on(D::kLaser, K::kWrong, now)) fault = RelayFault::kWrongEcho;
  if (script_.off_now(D::kLaser, now)) fault = RelayFault::kSilent;
  if (on(D::kLaser, K::kOff, now)) fault = RelayFault::kDead;
  relay.set_fault(fault);
  relay.set_welded(on(D::kLaser, K::kStuck, now));
  const FaultSpec* late = script_.active(D::kLaser, K::kDelayed, now);
  if (changed("laser late", late != nullptr))
    relay.set_answer_delay(late ? late->delay : RelayEmulatorSettings{}.answer_delay);
  const bool open = on(D::kInterlock, K::kOff, now) || script_.off_now(D::kInterlock, now);
  if (changed("interlock open", open)) relay.set_interlock_closed(!open);
  pull(relay, "laser", on(D::kLaser, K::kUnplugged, now));
}

void WireFaults::play_lux(Stamp now) {
  LuxEmulator& lux = *devices_.lux;
  LuxFault fault = LuxFault::kNone;
  if (on(D::kLuxMeter, K::kTorn, now)) fault = LuxFault::kTruncated;
  if (on(D::kLuxMeter, K::kGarbage, now)) fault = LuxFault::kNonsense;
  if (on(D::kLuxMeter, K::kOff, now) || script_.off_now(D::kLuxMeter, now)) fault = LuxFault::kSilent;
  lux.set_fault(fault);
  const FaultSpec* slow = script_.active(D::kLuxMeter, K::kSlow, now);
  if (changed("lux slow", slow != nullptr))
    lux.set_answer_delay(slow ? slow->delay : LuxEmulatorSettings{}.answer_delay);
  pull(lux, "lux", on(D::kLuxMeter, K::kUnplugged, now));
}

void WireFaults::play_cameras(Stamp now) {
  const auto silent = [&](const std::string& name) {
    return on(D::kCamera, K::kOff, now, name) || script_.off_now(D::kCamera, now, name);
  };
  for (const auto& [name, camera] : devices_.cameras) {
    const FaultSpec* lossy = script_.active(D::kCamera, K::kDropped, now, name);
    const double lost = silent(name) ? 1 : lossy ? lossy->ratio : 0;
    if (changed(name + " loses", lost)) camera->lose_packets(lost);
    const bool torn = on(D::kCamera, K::kTorn, now, name);
    if (changed(name + " torn", torn)) camera->send_short_pictures(torn);
    const FaultSpec* jump = script_.active(D::kCamera, K::kClockJump, now, name);
    if (changed(name + " jumps", jump != nullptr) && jump) camera->step_clock(jump->jump);
    pull(*camera, name, on(D::kCamera, K::kUnplugged, now, name));
  }
  for (const auto& [name, output] : devices_.outputs) {
    const bool stalled = silent(name) || on(D::kCamera, K::kUnplugged, now, name);
    if (changed(name + " stalled", stalled)) output->stall(stalled);
  }
}

double spoilt_lux(const FaultScript& script, double lux, Stamp now, double& last) {
  if (!script.active(FaultDevice::kLuxMeter, FaultKind::kStuck, now)) last = lux;
  const FaultSpec* wrong = script.active(FaultDevice::kLuxMeter, FaultKind::kWrong, now);
  return last * (wrong ? 1 + wrong->amount : 1);
}

}  // namespace tankrig::sim
