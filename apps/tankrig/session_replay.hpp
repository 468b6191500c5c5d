// `tankrig session replay`: a recorded session through the same code again, compared byte for byte.
#pragma once

#include <filesystem>

#include "apps/tankrig/command_line.hpp"

namespace tankrig::app {

struct SessionReplayOptions {
  std::filesystem::path session;
  std::filesystem::path out;  ///< keeps the replayed session; empty: made beside the session and removed
  double speed = 0;           ///< times real time; 0: as fast as possible
  bool json = false;
};

void add_session_replay(CLI::App& session, ChosenCommand& chosen);

/// kOk: identical. kFailure: something differs, named. kPartial: stopped.
int replay_session(const SessionReplayOptions& options);

}  // namespace tankrig::app
