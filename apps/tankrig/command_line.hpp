// How a command joins the command line: its options, and what runs with them, in one place.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>

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

}  // namespace tankrig::app
