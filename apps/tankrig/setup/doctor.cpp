// `tankrig doctor`: what this machine can and cannot do for a rig.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/camera_info.hpp"
#include "apps/tankrig/scan/plan_check.hpp"
#include "apps/tankrig/setup/commission_command.hpp"
#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "drivers/arm/arm5e_settings.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/gige_answer.hpp"
#include "drivers/camera/v4l2_settings.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/platform/devices.hpp"
#include "rig/platform/machine.hpp"
#include "rig/platform/sleep_inhibitor.hpp"

namespace tankrig::app {
namespace {

struct DoctorOptions {
  std::string rig = "tank-sim";
  double seconds = 5;                           ///< of the latency test
  std::filesystem::path sessions = "sessions";  ///< where scans would be recorded
  bool json = false;
  bool commission = false;  ///< the start-up test instead
  CommissionOptions test;
};

namespace fs = std::filesystem;

constexpr std::size_t kDiskTestBytes = 64 << 20;
constexpr int kEthernetPacket = 1500;
constexpr Duration kCameraAnswer = std::chrono::seconds(1);

/// Bytes/s that are recorded: a byte a pixel and colour.
double bytes_of(const CameraInfo& info) { return 1.0 * info.channels * info.width * info.height * info.rate_hz; }

double camera_bytes(const RigConfig& rig) {
  double sum = 0;
  for (const RigCamera& camera : rig.cameras) sum += bytes_of(camera_info(rig, camera));
  return sum;
}

bool emulated(const RigConfig& rig) { return rig.section("emulation").has_value(); }

/// What crosses the arm's bus while nobody here sends, over the length of the latency test.
class BusListener {
 public:
  explicit BusListener(const RigConfig& rig) {
    const auto devices = rig.section("devices");
    if (!devices || emulated(rig)) return;
    const Arm5eSettings arm = arm5e_settings_from(devices->child("arm"), "/run/tankrig");
    if (arm.carrier == ArmCarrier::kCan) interface_ = arm.can.interface, bitrate_ = arm.can.bitrate;
    begin_ = traffic();
  }
  std::optional<double> load() const {
    const auto end = begin_ ? traffic() : std::nullopt;
    return end ? std::optional(bus_load(*begin_, *end, bitrate_)) : std::nullopt;
  }

 private:
  std::optional<CanTraffic> traffic() const {
    return interface_.empty() ? std::nullopt : can_traffic("/", interface_, MonotonicClock{}.now());
  }

  std::string interface_;
  int bitrate_ = 0;
  std::optional<CanTraffic> begin_;
};

void check_arm(const ConfigNode& devices, const BusListener& bus, std::vector<Finding>& found) {
  const Arm5eSettings arm = arm5e_settings_from(devices.child("arm"), "/run/tankrig");
  const CarrierLoad load = carrier_load(arm);
  if (arm.carrier == ArmCarrier::kSerial) {
    found.push_back(serial_finding("/", "arm", arm.serial.device));
    return;
  }
  const CanNeed need{arm.can.interface, arm.can.bitrate, load.load};
  found.push_back(can_finding("/", need, read_can_link(arm.can.interface), bus.load()));
}

void check_gige(const RigCamera& camera, const AravisSettings& settings, std::vector<Finding>& found) {
  const std::string what = "camera " + camera.name;
  if (settings.address.empty()) {
    found.push_back({what, Verdict::kUsable, "searched for by its serial number",
                     "devices.cameras." + camera.name + ".address: opened at once, and checked here"});
    return;
  }
  const auto interface = interface_towards(settings.address);
  if (!interface) {
    found.push_back({what, Verdict::kAbsent, "no network holds " + settings.address,
                     "give the cameras' interface an address there: ip address add ...", true});
    return;
  }
  const int packet = settings.packet_size > 0 ? settings.packet_size : kEthernetPacket;
  found.push_back(mtu_finding(camera.name, interface->name, interface->mtu, packet));
  if (gige_device_answers(settings.address, kCameraAnswer))
    found.push_back({what, Verdict::kGood, settings.address + " answers"});
  else
    found.push_back({what, Verdict::kAbsent, settings.address + " does not answer",
                     "switch it on; arv-tool-0.8 lists those that answer", true});
}

void check_cameras(const RigConfig& rig, const ConfigNode& devices, std::vector<Finding>& found) {
  const ConfigNode cameras = devices.child("cameras");
  double gige_bytes = 0;
  for (const RigCamera& camera : rig.cameras) {
    const ConfigNode node = cameras.child(camera.name);
    const CameraInfo info = camera_info(rig, camera);
    if (node.choice("driver", {"aravis", "v4l2"}) == "v4l2") {
      found.push_back(v4l2_finding("/", camera.name, v4l2_settings_from(node, camera.name, info.channels).device));
      continue;
    }
    check_gige(camera, aravis_settings_from(node, info), found);
    gige_bytes += bytes_of(info);
  }
  if (gige_bytes > 0) found.push_back(receive_buffer_finding("/", gige_bytes));
}

void check_devices(const RigConfig& rig, const BusListener& bus, std::vector<Finding>& found) {
  const auto devices = rig.section("devices");
  if (!devices) throw InputError(rig.file, "devices: found nothing, expected arm, cameras, laser and lux_meter");
  if (emulated(rig)) {
    const Arm5eSettings arm = arm5e_settings_from(devices->child("arm"), "/run/tankrig");
    if (arm.carrier == ArmCarrier::kCan)
      found.push_back(can_finding("/", {arm.can.interface, arm.can.bitrate, carrier_load(arm).load}, std::nullopt));
    found.push_back({"devices", Verdict::kGood, "emulated: none is needed"});
    return;
  }
  check_arm(*devices, bus, found);
  found.push_back(serial_finding("/", "laser", devices->child("laser").text("device")));
  if (const auto lux = devices->optional_child("lux_meter"))
    found.push_back(serial_finding("/", "lux meter", lux->text("device")));
  check_cameras(rig, *devices, found);
}

/// A simulated scan waits for a slow disk; for room it cannot wait either.
void check_disk(const RigConfig& rig, const fs::path& sessions, std::vector<Finding>& found) {
  try {
    Finding speed = disk_finding(measure_disk(existing_parent(sessions), kDiskTestBytes), camera_bytes(rig));
    if (rig.backend == "mock" && speed.verdict == Verdict::kBad) {
      speed.verdict = Verdict::kUsable;
      speed.refused = false;
      speed.cure = "nothing to do: a simulated scan waits for a slow disk";
    }
    found.push_back(std::move(speed));
  } catch (const InputError& e) {
    found.push_back({"disk", Verdict::kBad, e.what(), "record elsewhere: tankrig scan --out", true});
  }
  try {
    const std::uint64_t need = disk_need(rig, make_scan_plan(rig.scan, rig.scan.park));
    found.push_back(room_finding(sessions, free_space(sessions), need));
  } catch (const InputError& e) {
    found.push_back({"plan", Verdict::kBad, e.what(), "change the rig file: tankrig scan --dry-run", true});
  }
}

/// A simulated rig asks nothing of the machine but a disk: the other verdicts are told, and refuse nothing.
std::vector<Finding> examine(const RigConfig& rig, const DoctorOptions& options, Progress& progress) {
  const bool mock = rig.backend == "mock";
  const RealTimeSettings& real_time = rig.scan.real_time;
  const BusListener bus(rig);
  std::vector<Finding> found{kernel_finding("/"), governor_finding("/"),         sleep_finding("/"),
                             suspend_finding(),   privileges_finding(real_time), memory_lock_finding(real_time)};
  progress.update("latency", 0);
  found.push_back(latency_finding(measure_wake_up(real_time, from_seconds(options.seconds))));
  progress.update("devices", 0);
  if (mock)
    found.push_back({"devices", Verdict::kGood, "simulated in this process under a virtual clock: nothing is needed"});
  else
    check_devices(rig, bus, found);
  if (mock)
    for (Finding& f : found) f.refused = false;
  progress.update("disk", 0);
  check_disk(rig, options.sessions, found);
  progress.finish_line();
  return found;
}

int exit_code(const std::vector<Finding>& found, bool mock) {
  if (std::any_of(found.begin(), found.end(), [](const Finding& f) { return f.refused; })) return kFailure;
  const auto to_mend = [](const Finding& f) { return f.verdict == Verdict::kBad; };
  return !mock && std::any_of(found.begin(), found.end(), to_mend) ? kPartial : kOk;
}

void print(const std::vector<Finding>& found, const RigConfig& rig, int code) {
  std::size_t width = 0;
  for (const Finding& f : found) width = std::max(width, f.what.size());
  for (const Finding& f : found) {
    std::printf("%-*s  %-9s  %s\n", static_cast<int>(width), f.what.c_str(), to_string(f.verdict), f.measured.c_str());
    if (!f.cure.empty()) std::printf("%-*s  %-9s  -> %s\n", static_cast<int>(width), "", "", f.cure.c_str());
  }
  const char* verdict = code == kOk        ? "can run this rig"
                        : code == kPartial ? "can run this rig; mend what is bad"
                                           : "cannot run this rig";
  std::printf("%s: this machine %s\n", rig.name.c_str(), verdict);
}

void print_as_json(const std::vector<Finding>& found, const RigConfig& rig, int code) {
  nlohmann::ordered_json out{{"rig", rig.name}, {"can_run", code != kFailure}};
  for (const Finding& f : found)
    out["findings"].push_back({{"what", f.what},
                               {"verdict", to_string(f.verdict)},
                               {"measured", f.measured},
                               {"cure", f.cure},
                               {"refused", f.refused}});
  print_json(out);
}

/// kOk: all is well; kPartial: something is to be mended; kFailure: this machine cannot run this rig.
int doctor(const DoctorOptions& options) {
  if (options.commission) return run_commission(options.rig, options.sessions, options.test, options.json);
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.rig));
  const std::vector<Finding> found = examine(rig, options, progress);
  const int code = exit_code(found, rig.backend == "mock");
  if (options.json)
    print_as_json(found, rig, code);
  else
    print(found, rig, code);
  return code;
}

}  // namespace

void add_doctor(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("doctor", "Check this machine for a rig, and say how to cure what is wrong");
  DoctorOptions& o = options_of(c, chosen, &doctor);
  c->footer(
      "Example: tankrig doctor --rig tank-wire --seconds 60\n"
      "         tankrig doctor --commission --operator Anna --rig /var/lib/tankrig/pool\n"
      "Exit codes: 0 all is well; 1 this machine cannot run this rig, or a step failed; 3 something is bad, or "
      "stopped");
  add_rig_option(c, o.rig);
  c->add_option("--seconds", o.seconds, "Length of the latency test [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  c->add_option("--sessions", o.sessions, "Folder for sessions, whose disk is measured")->capture_default_str();
  CLI::Option* const test =
      c->add_flag("--commission", o.commission,
                  "Try what protects people instead, with somebody at the tank: the arm moves and the laser shines");
  test->needs(c->add_option("--operator", o.test.operator_name, "With --commission: name of whoever stands at the tank")
                  ->needs(test));
  c->add_option("--waive", o.test.waived, "With --commission: leave this step out; repeat the option for more")
      ->allow_extra_args(false)
      ->check(CLI::IsMember(waivable_steps()))
      ->needs(test);
  c->add_option("--wait", o.test.wait_s, "With --commission: time for each thing that is asked for [s]")
      ->check(CLI::Range(1.0, 600.0))
      ->capture_default_str();
  c->add_flag("--yes", o.test.yes, "With --commission, with devices: do not ask before anything moves or shines")
      ->needs(test);
  add_carrier_option(c, o.test.carrier);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
