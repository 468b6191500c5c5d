// A session named on the command line: its path, its tables, and what is wrong with it.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/tankrig/command_line/progress.hpp"
#include "session/checking/open_session.hpp"

namespace tankrig::app {

/// The path of a session as the user may write it ("monday/", ".") as an absolute one without "." and trailing slash:
/// it has a name, and a place beside it.
std::filesystem::path session_path(const std::filesystem::path& given);

/// The positional options "session" and "sessions", by session_path().
CLI::Option* add_session_option(CLI::App* command, std::filesystem::path& session);
CLI::Option* add_sessions_option(CLI::App* command, std::vector<std::filesystem::path>& sessions,
                                 const std::string& what);

/// For a file to be written.
/// Errors: InputError if it would lie in a session, whichever.
void check_in_no_session(const std::filesystem::path& out);

/// Errors: InputError if `out` is the session or lies in it.
void check_outside(const std::filesystem::path& out, const std::filesystem::path& session);

/// Opens a session and warns of all that is wrong with it.
/// Errors: InputError if it cannot be used at all.
OpenedSession open_with_warnings(const std::filesystem::path& path, Progress& progress);

}  // namespace tankrig::app
