// `tankrig guardian`: the process that every command which may move or shine starts; and the operator's word to it.
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/emulation_process.hpp"
#include "apps/tankrig/devices/guarded.hpp"
#include "core/input_error.hpp"
#include "drivers/laser/relay_laser.hpp"

namespace tankrig::app {
namespace {

struct GuardianOptions {
  std::string rig = "tank-sim", carrier, command;
  std::filesystem::path runtime;  ///< of emulated devices; empty: they are real
  std::string acknowledge;
  int control = -1, memory = -1;
};

int acknowledge(const GuardianOptions& options, const std::filesystem::path& report) {
  if (options.acknowledge != kPowerIsCut)
    throw InputError("--acknowledge: found '" + options.acknowledge + "', expected the words: " + kPowerIsCut);
  const auto process = guardian_at_work(report);
  if (!process) throw InputError(report, "no guardian makes safe there, expected one");
  if (::kill(*process, SIGUSR1) != 0)
    throw InputError("guardian: process " + std::to_string(*process) + " is not yours");
  std::printf("told the guardian, process %d: %s\n", *process, kPowerIsCut);
  return kOk;
}

int guardian(const GuardianOptions& options) {
  const RigConfig rig = load_rig(find_rig(options.rig));
  const auto devices = rig.section("devices");
  if (!devices) throw InputError(rig.file, "devices: found nothing: a simulated rig has no guardian");
  const char* const emulated = std::getenv(kRuntimeVariable);
  const std::filesystem::path runtime = options.runtime.empty() && emulated ? emulated : options.runtime;
  GuardianSettings settings;
  settings.arm = arm5e_settings_from(devices->child("arm"), runtime, options.carrier);
  settings.report = guardian_report(rig, settings.arm.zero_file);
  if (!options.acknowledge.empty()) return acknowledge(options, settings.report);
  if (options.control < 0 || options.memory < 0)
    throw InputError("guardian: found no command to guard, expected --acknowledge \"" + std::string(kPowerIsCut) +
                     "\": the commands that move or shine start theirs themselves");
  const RelayLaserSettings laser = relay_laser_settings_from(devices->child("laser"), runtime);
  settings.laser_line = laser.serial;
  settings.laser = laser.protocol;
  settings.command = options.command;
  settings.emulated = rig.section("emulation").has_value();
  return run_guardian(settings, OwnedDescriptor(options.control), OwnedDescriptor(options.memory));
}

}  // namespace

std::filesystem::path guardian_report(const RigConfig& rig, const std::filesystem::path& zero_file) {
  if (!zero_file.empty()) return zero_file.string() + ".guardian";
  return std::filesystem::temp_directory_path() / ("tankrig-" + rig.name + ".guardian");
}

void add_guardian(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand(
      "guardian", "Switch the laser off and stop the arm when another command dies or hangs (started by that command)");
  GuardianOptions& o = options_of(c, chosen, &guardian);
  c->footer("Example: tankrig guardian --rig /var/lib/tankrig/pool --acknowledge \"the power is cut\"");
  add_rig_option(c, o.rig);
  add_carrier_option(c, o.carrier);
  c->add_option("--acknowledge", o.acknowledge,
                "Tell a guardian that goes on asking, in the words \"the power is cut\", that it may end");
  c->add_option("--runtime", o.runtime, "Folder of the emulated devices");
  c->add_option("--command", o.command, "What it guards, for its messages");
  c->add_option("--control", o.control, "Descriptor of the socket to the command that it guards");
  c->add_option("--memory", o.memory, "Descriptor of the memory that it shares with that command");
}

}  // namespace tankrig::app
