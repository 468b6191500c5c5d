// `tankrig emulate`: the devices of a simulated rig on the wires of real ones, for as long as it runs.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/command_line.hpp"

namespace tankrig::app {

struct EmulateOptions {
  std::string rig = "tank-wire";
  std::vector<std::string> devices;  ///< of arm, cameras, laser, lux; empty: all
  std::filesystem::path runtime;     ///< folder of buses and serial lines; empty: a fresh one
  std::optional<double> light, noise, particles;
  std::optional<std::string> sensor;
  std::uint64_t seed = 1;
  std::filesystem::path faults;      ///< fault plan; empty: none
  std::filesystem::path truth;       ///< folder for what was true of every exposure; empty: not kept
  int ready_fd = -1;                 ///< gets one byte when every device answers
  std::vector<std::string> command;  ///< runs beside the devices, on a network of its own with them
};

void add_emulate(CLI::App& app, ChosenCommand& chosen);
/// Returns the command's exit code, if there is a command.
int emulate(const EmulateOptions& options);

}  // namespace tankrig::app
