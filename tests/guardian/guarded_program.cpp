#include "tests/guardian/guarded_program.hpp"

#include <atomic>
#include <csignal>
#include <fstream>

#include "drivers/arm/arm5e.hpp"
#include "drivers/arm/arm_zero.hpp"
#include "drivers/laser/relay_laser.hpp"
#include "rig/guardian/guardian_process.hpp"
#include "rig/safety/rest_watch.hpp"
#include "tests/support/bench_right.hpp"

namespace tankrig::testing_support {
namespace {

using namespace std::chrono_literals;

std::atomic<bool> asked{false};
extern "C" void ask(int) { asked = true; }

constexpr Duration kCycle = 5ms, kPatience = 60ms;

}  // namespace

GuardianSettings guarded_devices(const std::filesystem::path& folder, const std::string& carrier) {
  GuardianSettings s;
  s.laser_line = {.device = (folder / "laser").string(), .baud = 9600};
  s.laser.status_query = 3;
  s.arm.carrier = carrier == "can" ? ArmCarrier::kCan : ArmCarrier::kSerial;
  s.arm.can.interface = "unix:" + (folder / "arm.can").string();
  s.arm.can.bitrate = 1'000'000;
  s.arm.can.filters = s.arm.can_ids.arm_filters();
  s.arm.serial.device = folder / "arm";
  s.arm.exchange_rate_hz = carrier == "can" ? 200 : 75;
  s.arm.silence_timeout = 10s;
  s.arm.watchdog = 10s;
  s.command = "test";
  s.report = folder / "report";
  return s;
}

int run_guarded_program(const std::filesystem::path& folder, const std::string& carrier) {
  std::signal(SIGTERM, ask);
  const GuardianSettings devices = guarded_devices(folder, carrier);
  MonotonicClock clock;
  GuardianProcess guardian({"guardian", folder.string(), carrier});
  std::ofstream(folder / "guardian.pid") << guardian.process() << std::flush;
  RelayLaserSettings relay{.serial = devices.laser_line, .protocol = devices.laser, .warm_up = 20ms};
  relay.caller_timeout = 10s;
  relay.serial.opened = guardian.line(GuardianLine::kLaser);
  Arm5eSettings arm_settings = devices.arm;
  arm_settings.serial.opened = guardian.line(GuardianLine::kArm);
  RelayLaser laser(relay);
  const auto arm = open_arm5e(arm_settings, arm5e(), clock);
  laser.set_veto(guardian.taken_over());
  arm->set_veto(guardian.taken_over());
  guardian.wait_until_ready();
  arm->set_zero(load_arm_zero(folder / "zero.yaml"));

  guardian.begin(kPatience);
  RestWatch rest(0.01);
  bool objected = false, driving = true;
  const Stamp begin = clock.now();
  for (Stamp next = begin; driving || !rest.at_rest(); clock.sleep_until(next = next + kCycle)) {
    const Stamp now = clock.now();
    objected = objected || guardian.objection(now) != nullptr;
    if (objected && now - begin > 1min) return 1;
    const auto news = arm->try_read();
    driving = !objected && !asked;
    if (driving) {
      JointVector velocity = JointVector::Zero();
      velocity[kElbow] = static_cast<std::int64_t>(seconds(now - begin)) % 4 < 2 ? 0.1 : -0.1;
      (void)BenchRight::light(laser);
      (void)drive(*arm, velocity);
    } else {
      (void)laser.off();
      (void)arm->stop();
      if (news.ok() && news.value()) rest.add(*news.value());
      if (objected) break;
    }
    BenchRight::complete(guardian);
  }
  if (objected) return kObjected;
  guardian.release();
  return 0;
}

}  // namespace tankrig::testing_support
