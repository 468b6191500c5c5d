#include "rig/session/session_recover.hpp"

#include <unistd.h>

#include <algorithm>

#include "rig/session/checksums.hpp"
#include "rig/session/session_folder.hpp"
#include "rig/session/session_lock.hpp"
#include "rig/session/session_yaml.hpp"
#include "rig/session/spool.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

/// A folder that is gone again unless its path is taken back.
struct Scaffold {
  fs::path path;
  ~Scaffold() {
    std::error_code ignored;
    if (!path.empty()) fs::remove_all(path, ignored);
  }
};

/// Where replaced files go: lost+found/N, N the first that is free, made when needed.
class LostAndFound {
 public:
  explicit LostAndFound(const fs::path& session) : session_(session) {
    int n = 1;
    do folder_ = session_ / "lost+found" / std::to_string(n++);
    while (fs::exists(folder_));
  }

  /// A second name for a file that is about to be replaced, or a copy.
  void keep(const fs::path& file) const {
    if (!fs::exists(session_ / file)) return;
    std::error_code failed;
    fs::create_hard_link(session_ / file, place_of(file), failed);
    if (failed) fs::copy_file(session_ / file, place_of(file));
  }

  void move(const fs::path& file) const {
    if (fs::exists(session_ / file)) fs::rename(session_ / file, place_of(file));
  }

 private:
  fs::path place_of(const fs::path& file) const {
    fs::create_directories((folder_ / file).parent_path());
    return folder_ / file;
  }

  fs::path session_, folder_;
};

/// Whole or not at all; on the disk, but for its name.
void copy_session(const fs::path& from, const fs::path& to) {
  if (fs::exists(to)) throw InputError(to, "exists already, expected a new session directory");
  if (lies_within(to, from))
    throw InputError(to, "lies in the session " + from.string() + ", expected a place outside");
  const SessionLock at_rest(from);
  if (to.has_parent_path()) fs::create_directories(to.parent_path());
  Scaffold temporary{to.string() + "." + std::to_string(::getpid()) + kUnfinished};
  try {
    FileSystemSync disk(to.parent_path());
    fs::copy(from, temporary.path, fs::copy_options::recursive);
    disk.sync();
    fs::rename(temporary.path, to);
  } catch (const fs::filesystem_error& e) {
    throw InputError(e.path1(), "cannot be copied to " + to.string() + ": " + e.code().message());
  }
  temporary.path.clear();
}

template <class Record>
void mend_table(const fs::path& session, const std::string& name, const SalvagedTable<Record>& table,
                const LostAndFound& lost) {
  if (!table.damaged) return;
  lost.keep(name);
  write_file_durably(session / name, table.text);
}

template <class Record>
TableSpan span_of(const std::vector<Record>& records) {
  if (records.empty()) return {};
  return {records.size(), records.front().stamp, records.back().stamp};
}

SessionInfo mended_info(const SessionFindings& found) {
  SessionInfo info = found.info;
  if (!found.losses.empty())
    info.status = "stopped: recovered, " + std::to_string(found.losses.size()) + " losses" +
                  (info.status.starts_with("stopped: ") ? "; " + info.status.substr(9) : "");
  for (const std::string& loss : found.losses)
    if (std::find(info.recovered.begin(), info.recovered.end(), loss) == info.recovered.end())
      info.recovered.push_back(loss);
  info.tables["joints"] = span_of(found.joints.records);
  info.tables["frames"] = span_of(found.frames.records);
  info.tables["events"] = span_of(found.events.records);
  for (const SessionCamera& camera : info.cameras) {
    const auto there =
        static_cast<std::uint64_t>(std::count_if(found.frames.records.begin(), found.frames.records.end(),
                                                 [&](const FrameRecord& f) { return f.camera == camera.name; }));
    std::uint64_t& recorded = info.counts[camera.name + ".recorded"];
    if (info.account.contains(camera.name) && recorded > there)
      info.counts[camera.name + ".lost_from_session"] += recorded - there;
    recorded = there;
  }
  return info;
}

/// What of the spool could not become pictures is kept as it is.
void empty_spool(const fs::path& session, const LostAndFound& lost) {
  for (const fs::path& segment : spool_segments(session)) lost.move(segment.lexically_relative(session));
  fs::remove_all(spool_folder(session));
}

Recovery mend_session(const fs::path& session, const RecoverOptions& options) {
  const SessionLock lock(session);
  Recovery result{session, examine_session(session, options.describe)};
  const SessionFindings& found = result.found;
  result.finished = found.whole();
  if (!found.whole() && !found.usable()) return result;
  FileSystemSync disk(session);
  if (found.whole()) {
    disk.sync();  // it may be whole for having been sealed a moment before its disk failed
    return result;
  }

  const LostAndFound lost(session);
  lost.keep("session.yaml");
  write_file_durably(session / "session.yaml",
                     session_yaml(mended_info(found), found.calibration));  // first: what was lost is never forgotten
  lost.move("SHA256SUMS");
  mend_table(session, "joints.csv", found.joints, lost);
  mend_table(session, "events.csv", found.events, lost);
  mend_table(session, "frames.csv", found.frames, lost);
  for (const std::string& file : found.set_aside) lost.move(file);
  if (!write_spooled_pictures(session, options.pictures)) return result;
  empty_spool(session, lost);
  Session::open(session);  // what cannot be opened is not sealed
  disk.sync();
  write_checksums(session);
  result.finished = true;
  return result;
}

}  // namespace

Recovery recover_session(const fs::path& source, const RecoverOptions& options) {
  if (fs::is_directory(source)) refuse_links(source);
  if (options.out.empty()) return mend_session(source, options);
  const fs::path out = options.out.has_filename() ? options.out : options.out.parent_path();
  copy_session(source, out);
  Scaffold copy{out};
  sync_folder(out.parent_path());
  Recovery result = mend_session(out, options);
  if (result.finished)
    copy.path.clear();
  else
    result.session = source;
  return result;
}

}  // namespace tankrig
