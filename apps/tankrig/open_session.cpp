#include "apps/tankrig/open_session.hpp"

#include "core/input_error.hpp"
#include "core/text_files.hpp"
#include "session/checking/checksums.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

void lose(Session& session, const std::string& what) {
  session.warnings.push_back(what);
  session.all_there = false;
}

template <class Record>
std::vector<Record> table_of(Session& session, const std::string& name,
                             SessionTable<Record> (*read)(const fs::path&, bool)) {
  const fs::path file = session.path / (name + ".csv");
  if (!fs::exists(file)) {
    lose(session, name + ".csv: missing");
    return {};
  }
  try {
    SessionTable<Record> table = read(file, session.info.status == "recording");
    if (table.cut_short) lose(session, name + ".csv: its last line is incomplete and left out");
    const std::string missing = lines_missing(session.info, name, table.records.size());
    if (!missing.empty()) lose(session, missing);
    return std::move(table.records);
  } catch (const InputError& e) {
    lose(session, std::string(e.what()) + "; the table is left out");
    return {};
  }
}

void compare_with_seal(OpenedSession& opened) {
  Session& session = opened.session;
  if (!fs::exists(session.path / "SHA256SUMS")) return;
  try {
    for (const ChecksumDifference& difference : compare_checksums(session.path)) {
      opened.unlike_seal.push_back(in_words(difference) + " since the session was sealed");
      session.warnings.push_back(opened.unlike_seal.back());
      if (difference.kind == ChecksumDifference::Kind::kMissing && !is_derived(difference.file))
        session.all_there = false;
    }
  } catch (const InputError& e) {
    session.warnings.emplace_back(e.what());
  }
}

}  // namespace

fs::path session_path(const fs::path& given) {
  if (given.empty()) return given;
  const fs::path path = fs::absolute(given).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

CLI::Option* add_session_option(CLI::App* command, fs::path& session) {
  return command->add_option("session", session, "Session directory")
      ->required()
      ->transform([](const std::string& given) { return session_path(given).string(); });
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

OpenedSession open_session(const fs::path& path, Progress& progress) {
  OpenedSession opened{Session::open(path), {}, {}, {}};
  Session& session = opened.session;
  opened.joints = table_of<JointState>(session, "joints", read_joints_csv);
  opened.events = table_of<SessionEvent>(session, "events", read_events_csv);
  compare_with_seal(opened);
  for (const std::string& warning : session.warnings) progress.warn(warning);
  if (session.info.status != "complete") progress.warn(path.string() + ": " + session.info.status);
  return opened;
}

}  // namespace tankrig::app
