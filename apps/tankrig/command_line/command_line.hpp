// How a command joins the command line: its options, and what runs with them, in one place.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>

namespace tankrig::app {

/// What the command line asks for, with its options; returns the exit code. Set while it is parsed, run by main.
using ChosenCommand = std::function<int()>;

/// The options that `run` gets if `command` is the one that is given.
template <class Options>
Options& options_of(CLI::App* command, ChosenCommand& chosen, int (*run)(const Options&)) {
  const auto options = std::make_shared<Options>();
  command->callback([options, &chosen, run] { chosen = [options, run] { return run(*options); }; });
  return *options;
}

/// Options that several commands share, worded alike everywhere.
inline void add_rig_option(CLI::App* command, std::string& rig) {
  command->add_option("--rig", rig, "Name of a rig in etc/rigs, or a rig file, or its folder")->capture_default_str();
}
inline void add_carrier_option(CLI::App* command, std::string& carrier) {
  command->add_option("--carrier", carrier, "The arm's connection, on a rig with devices (default: the rig file's)")
      ->check(CLI::IsMember({"can", "serial"}));
}
inline void add_json_flag(CLI::App* command, bool& json) {
  command->add_flag("--json", json, "Print one JSON object on standard output");
}

}  // namespace tankrig::app
