// `tankrig emulate`: the devices of a simulated rig on the wires of real ones, for as long as it runs.

#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <utility>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/emulation_process.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "apps/tankrig/devices/world_options.hpp"
#include "core/input_error.hpp"
#include "sim_backends/wire/emulated_tank.hpp"
#include "sim_backends/wire/private_network.hpp"

namespace tankrig::app {
namespace {

struct EmulateOptions {
  std::string rig = "tank-wire";
  std::vector<std::string> devices;  ///< of arm, cameras, laser, lux, box; empty: all
  std::filesystem::path runtime;     ///< folder of buses and serial lines; empty: a fresh one
  sim::WorldOptions world;
  std::filesystem::path faults;      ///< fault plan; empty: none
  std::filesystem::path truth;       ///< folder for what was true of every exposure; empty: not kept
  int ready_fd = -1;                 ///< gets one byte when every device answers
  std::vector<std::string> command;  ///< runs beside the devices, on a network of its own with them
};

constexpr Duration kStopLook = std::chrono::milliseconds{20};  // at the stop flag and the command

sim::EmulatedTankSettings settings_of(const RigConfig& rig, const EmulateOptions& options,
                                      const std::filesystem::path& runtime, const sim::TankWorld& world) {
  const auto devices = rig.section("devices"), emulation = rig.section("emulation");
  if (!devices) throw InputError(rig.file, "devices: found nothing, expected the devices to emulate");
  sim::EmulatedTankSettings settings =
      sim::emulated_tank_settings_from(*devices, emulation, world, runtime, rig.scan.safety.heartbeat_output);
  for (const RigCamera& camera : rig.cameras) scene_camera(rig, camera, world);
  settings.truth = options.truth;
  if (!options.faults.empty())
    settings.faults = sim::FaultPlan::load(options.faults, sim::FaultLevel::kWire, camera_names(rig));
  const auto wanted = [&](const char* device) {
    return options.devices.empty() ||
           std::find(options.devices.begin(), options.devices.end(), device) != options.devices.end();
  };
  if (!wanted("arm")) settings.arm.reset();
  if (!wanted("cameras")) {
    settings.cameras.clear();
    settings.video_outputs.clear();
  }
  if (!wanted("laser")) settings.laser.reset();
  if (!wanted("lux")) settings.lux.reset();
  if (!wanted("box")) settings.box.reset();
  if (!settings.laser && !settings.box) settings.hand.clear();
  return settings;
}

pid_t start(const std::vector<std::string>& command) {
  std::vector<std::string> words = command;
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawnattr_t attributes;
  sigset_t ordinary;
  sigemptyset(&ordinary);
  for (const int signal : {SIGPIPE, SIGXFSZ}) sigaddset(&ordinary, signal);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  ::posix_spawnattr_setsigdefault(&attributes, &ordinary);
  pid_t process = -1;
  const int problem = ::posix_spawnp(&process, argv[0], nullptr, &attributes, argv.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  if (problem != 0) throw InputError("emulate: " + command[0] + ": " + std::strerror(problem));
  return process;
}

/// Until the command ends. Who asks this program to stop asks the command, once: it may have an arm to bring to rest.
int wait_for(pid_t process, Clock& clock) {
  bool asked = false;
  int status = 0;
  while (::waitpid(process, &status, WNOHANG) == 0) {
    if (StopOnSignal::requested() && !std::exchange(asked, true)) ::kill(process, SIGTERM);
    clock.sleep_until(clock.now() + kStopLook);
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

int wait_for_stop(Clock& clock) {
  while (!StopOnSignal::requested()) clock.sleep_until(clock.now() + kStopLook);
  return kOk;
}

/// Returns the command's exit code, if there is a command.
int emulate(const EmulateOptions& options) {
  const RigConfig rig = load_rig(find_rig(options.rig));
  if (rig.scene.empty()) throw InputError(rig.file, "scene: found nothing, expected the scene to emulate");
  const bool cameras = options.devices.empty() ||
                       std::find(options.devices.begin(), options.devices.end(), "cameras") != options.devices.end();
  const auto devices = rig.section("devices");
  if (!options.command.empty() && cameras && devices && sim::needs_private_network(*devices))
    if (const Status entered = sim::enter_private_network(); !entered)
      throw InputError(std::string("emulate: ") + entered.error().where + ": " +
                       std::strerror(entered.error().os_errno));
  std::optional<RuntimeFolder> own;
  if (options.runtime.empty()) own.emplace();
  const std::filesystem::path runtime = own ? own->path() : options.runtime;
  std::error_code ignored;
  std::filesystem::create_directories(runtime);
  ::setenv(kRuntimeVariable, runtime.c_str(), 1);
  const char* const path = ::getenv("PATH");
  const std::string own_folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
  ::setenv("PATH", (own_folder + ":" + (path ? path : "")).c_str(), 1);  // the command may be tankrig itself

  MonotonicClock clock;
  const StopOnSignal stop_on_signal;
  const sim::TankWorld world = load_world(rig, options.world);
  sim::EmulatedTank tank(world, settings_of(rig, options, runtime, world), clock);
  if (options.ready_fd >= 0) {
    const char ready = 'r';
    if (::write(options.ready_fd, &ready, 1) != 1) throw InputError("--ready-fd: " + std::string(std::strerror(errno)));
    ::close(options.ready_fd);
  }
  if (options.command.empty() && options.ready_fd < 0) std::printf("%s\nCtrl-C ends it\n", tank.description().c_str());
  std::fflush(stdout);
  if (options.ready_fd >= 0) {  // whoever made the runtime folder for us may have been killed
    const int code = wait_for_stop(clock);
    std::filesystem::remove_all(runtime, ignored);
    return code;
  }
  return options.command.empty() ? wait_for_stop(clock) : wait_for(start(options.command), clock);
}

}  // namespace

void add_emulate(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("emulate", "Emulate a rig's devices on CAN, serial lines and GigE Vision");
  EmulateOptions& o = options_of(c, chosen, &emulate);
  c->footer(
      "Example: tankrig emulate --rig tank-wire -- tankrig arm status --rig tank-wire\n"
      "With a command, devices and command share a private network and end together.\n"
      "Without one, the devices stay on this machine's network until Ctrl-C.");
  add_rig_option(c, o.rig);
  c->add_option("--device", o.devices, "Emulate only this device; repeat the option for more")
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"arm", "cameras", "laser", "lux", "box"}));
  c->add_option("--runtime", o.runtime, "Folder for the buses and serial lines (default: a new one)");
  add_world_options(c, o.world);
  c->add_option("--faults", o.faults, "Fault plan to play on the emulated devices (docs/reference/faults.md)")
      ->check(CLI::ExistingFile);
  c->add_option("--truth", o.truth, "Folder for the ground truth of every exposure");
  c->add_option("--ready-fd", o.ready_fd, "File descriptor that gets one byte when every device answers");
  c->add_option("command", o.command, "Command to run with the devices, after --");
}

}  // namespace tankrig::app
