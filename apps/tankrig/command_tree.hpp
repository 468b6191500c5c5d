// What follows from the command line's own tree of commands: completion in bash and the manual page.
#pragma once

#include <string>

#include "apps/tankrig/command_line.hpp"

namespace tankrig::app {

/// A script that completes commands, options and the values that an option names; elsewhere bash completes files.
std::string bash_completion(const CLI::App& app);

/// The manual page, as man(7) lays it out: every command with its options and its example.
std::string manual_page(const CLI::App& app);

void add_completion(CLI::App& app, ChosenCommand& chosen);
void add_manual(CLI::App& app, ChosenCommand& chosen);

}  // namespace tankrig::app
