// The commands: each defines its options and help on the command line, and what runs with them.
#pragma once

#include "apps/tankrig/command_line/command_line.hpp"

namespace tankrig::app {

/// Those of a program: all_commands.cpp, scan_commands.cpp.
void add_commands(CLI::App& app, ChosenCommand& chosen);

void add_scan(CLI::App& app, ChosenCommand& chosen);
void add_bench(CLI::App& app, ChosenCommand& chosen);
void add_experiment(CLI::App& app, ChosenCommand& chosen);
void add_reconstruct(CLI::App& app, ChosenCommand& chosen);
void add_evaluate(CLI::App& app, ChosenCommand& chosen);
void add_cloud(CLI::App& app, ChosenCommand& chosen);
void add_session(CLI::App& app, ChosenCommand& chosen);
void add_report(CLI::App& app, ChosenCommand& chosen);
void add_doctor(CLI::App& app, ChosenCommand& chosen);
void add_init(CLI::App& app, ChosenCommand& chosen);
void add_arm(CLI::App& app, ChosenCommand& chosen);
void add_camera(CLI::App& app, ChosenCommand& chosen);
void add_guardian(CLI::App& app, ChosenCommand& chosen);
void add_emulate(CLI::App& app, ChosenCommand& chosen);
void add_serve(CLI::App& app, ChosenCommand& chosen);
void add_calibrate(CLI::App& app, ChosenCommand& chosen);
void add_budget(CLI::App& app, ChosenCommand& chosen);
void add_completion(CLI::App& app, ChosenCommand& chosen);
void add_manual(CLI::App& app, ChosenCommand& chosen);

/// Below `tankrig session`.
void add_session_check(CLI::App& session, ChosenCommand& chosen);
void add_session_replay(CLI::App& session, ChosenCommand& chosen);
void add_session_export(CLI::App& session, ChosenCommand& chosen);

}  // namespace tankrig::app
