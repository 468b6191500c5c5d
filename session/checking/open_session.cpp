#include "session/checking/open_session.hpp"

#include "core/input_error.hpp"
#include "session/checking/checksums.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

template <class Record>
std::vector<Record> table_of(Session& session, const std::string& name,
                             SessionTable<Record> (*read)(const fs::path&, bool)) {
  const fs::path file = session.path / (name + ".csv");
  if (!fs::exists(file)) {
    session.lose(name + ".csv: missing");
    return {};
  }
  try {
    SessionTable<Record> table = read(file, session.info.status == "recording");
    if (table.cut_short) session.lose(name + ".csv: its last line is incomplete and left out");
    const std::string missing = lines_missing(session.info, name, table.records.size());
    if (!missing.empty()) session.lose(missing);
    return std::move(table.records);
  } catch (const InputError& e) {
    session.lose(std::string(e.what()) + "; the table is left out");
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

OpenedSession open_session(const fs::path& path) {
  OpenedSession opened{Session::open(path), {}, {}, {}};
  Session& session = opened.session;
  opened.joints = table_of<JointState>(session, "joints", read_joints_csv);
  opened.events = table_of<SessionEvent>(session, "events", read_events_csv);
  compare_with_seal(opened);
  return opened;
}

}  // namespace tankrig
