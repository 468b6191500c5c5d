// `tankrig session check` and `recover`: whether a session is whole, and how it is made so.
#pragma once

#include <filesystem>

#include "apps/tankrig/command_line.hpp"

namespace tankrig::app {

struct SessionCheckOptions {
  std::filesystem::path session;
  bool json = false;
};

struct SessionRecoverOptions {
  std::filesystem::path session;
  std::filesystem::path out;  ///< mend a copy here; empty: in place
  bool json = false;
};

/// Defines both below `tankrig session`.
void add_session_check(CLI::App& session, ChosenCommand& chosen);

/// kOk: whole; kPartial: usable, its losses listed; kFailure: nothing usable.
int check_session(const SessionCheckOptions& options);

/// kOk: the session is whole now, whatever was lost before; kPartial: stopped before its end; kFailure: nothing usable.
int recover_session(const SessionRecoverOptions& options);

}  // namespace tankrig::app
