#include "session/checking/session_recover.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/text_files.hpp"
#include "session/checking/checksums.hpp"
#include "session/reading/session_folder.hpp"
#include "session/reading/session_yaml.hpp"
#include "session/recording/session_lock.hpp"
#include "session/recording/spool.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

/// Where replaced files go: lost+found/N, N the first that is free, made when needed.
class LostAndFound {
 public:
  explicit LostAndFound(const fs::path& session) : session_(session) {
    int n = 1;
    do folder_ = session_ / "lost+found" / fmt::to_string(n++);
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

/// All of `from`, on the disk.
void copy_session(const fs::path& from, const UnfinishedFolder& to) {
  try {
    FileSystemSync disk(to.path());
    fs::copy(from, to.path(), fs::copy_options::recursive);
    disk.sync();
  } catch (const fs::filesystem_error& e) {
    throw InputError(e.path1(), "cannot be copied to " + to.target().string() + ": " + e.code().message());
  }
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
    info.status = fmt::format("stopped: recovered, {} losses{}", found.losses.size(),
                              info.status.starts_with("stopped: ") ? "; " + info.status.substr(9) : "");
  for (const std::string& loss : found.losses)
    if (std::find(info.recovered.begin(), info.recovered.end(), loss) == info.recovered.end())
      info.recovered.push_back(loss);
  info.tables["joints"] = span_of(found.joints.records);
  info.tables["frames"] = span_of(found.frames.records);
  info.tables["events"] = span_of(found.events.records);
  for (const CalibratedCamera& camera : info.cameras) {
    const auto there =
        static_cast<std::uint64_t>(std::count_if(found.frames.records.begin(), found.frames.records.end(),
                                                 [&](const FrameRecord& f) { return f.camera == camera.name; }));
    if (!info.counts.contains(camera.name + ".recorded")) info.account.erase(camera.name);  // nobody knows any more
    std::uint64_t& recorded = info.counts[camera.name + ".recorded"];
    if (info.account.contains(camera.name) && recorded > there)
      info.counts[camera.name + ".lost_from_session"] += recorded - there;
    recorded = there;
  }
  return info;
}

/// How frames of a spool that others may have written become pictures: one of a name, of a camera there is, and none
/// takes the place of a file that is not kept.
PictureOptions careful(PictureOptions pictures, const SessionInfo& info, const LostAndFound& lost) {
  pictures.accept = [&info, names = std::set<std::string>{}](const FrameRecord& frame) mutable {
    return info.has_camera(frame.camera) && names.insert(frame.file).second;
  };
  pictures.set_aside = [&lost](const std::string& file) { lost.move(file); };
  return pictures;
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
  if (!write_spooled_pictures(session, careful(options.pictures, found.info, lost))) return result;
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
  if (fs::exists(options.out)) throw InputError(options.out, "exists already, expected a new session directory");
  if (lies_within(options.out, source))
    throw InputError(options.out, "lies in the session " + source.string() + ", expected a place outside");
  const SessionLock at_rest(source);
  UnfinishedFolder copy(options.out);
  copy_session(source, copy);
  Recovery result = mend_session(copy.path(), options);
  if (result.finished) copy.put_in_place();
  result.session = result.finished ? copy.target() : source;
  return result;
}

}  // namespace tankrig
