#include "apps/tankrig/session/open_session.hpp"

#include "core/input_error.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
fs::path session_path(const fs::path& given) {
  if (given.empty()) return given;
  const fs::path path = fs::absolute(given).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

CLI::Option* add_session_option(CLI::App* command, fs::path& session) {
  return command->add_option("session", session, "Session folder")->required()->transform([](const std::string& given) {
    return session_path(given).string();
  });
}

CLI::Option* add_sessions_option(CLI::App* command, std::vector<fs::path>& sessions, const std::string& what) {
  return command->add_option("sessions", sessions, what)->required()->transform([](const std::string& given) {
    return session_path(given).string();
  });
}

void check_in_no_session(const fs::path& out) {
  std::error_code ignored;
  const fs::path file = fs::weakly_canonical(fs::absolute(out));
  for (fs::path folder = file.parent_path(); folder.has_relative_path(); folder = folder.parent_path())
    if (fs::exists(folder / "session.yaml", ignored))
      throw InputError(out, "lies in the session " + folder.string() + ", expected a place outside");
}

void check_outside(const fs::path& out, const fs::path& session) {
  if (lies_within(out, session))
    throw InputError(out, "lies in the session " + session.string() + ", expected a place outside");
}

OpenedSession open_with_warnings(const fs::path& path, Progress& progress) {
  OpenedSession opened = open_session(path);
  const Session& session = opened.session;
  for (const std::string& warning : session.warnings) progress.warn(warning);
  if (session.info.status != "complete") progress.warn(path.string() + ": " + session.info.status);
  return opened;
}

}  // namespace tankrig::app
