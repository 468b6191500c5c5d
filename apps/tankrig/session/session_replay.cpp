// `tankrig session replay`: a recorded session through the same code again, compared byte for byte.

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "apps/tankrig/session/session_comparison.hpp"
#include "core/clock.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "pipeline/score_session.hpp"
#include "rig/config/rig_config.hpp"
#include "rig/scan/replay.hpp"
#include "session/checking/checksums.hpp"
#include "session/reading/session_rig_file.hpp"
#include "session/recording/session_writer.hpp"
#include "session/recording/spool.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct SessionReplayOptions {
  std::filesystem::path session;
  std::filesystem::path out;  ///< keeps the replayed session; empty: made beside the session and removed
  double speed = 0;           ///< times real time; 0: as fast as possible
  bool json = false;
};

/// What a replay makes itself. The rest of a session is taken over.
const std::vector<std::string> kFed{"joints.csv", "frames.csv", "events.csv", "session.yaml", "frames"};
const std::vector<std::string> kMade{"clouds", "results", "pictures", "report.html", "SHA256SUMS"};

/// What has been compared, byte for byte.
struct Comparison {
  std::size_t tables = 0, images = 0, clouds = 0, scores = 0;  ///< identical
  std::vector<std::string> differences;                        ///< "FILE: what"

  void compare(const fs::path& recorded, const fs::path& replayed, const std::string& file, std::size_t& identical) {
    if (!fs::exists(recorded / file)) return;
    const std::string what = difference(recorded / file, replayed / file);
    if (what.empty())
      ++identical;
    else
      differences.push_back(file + ": " + what);
  }
};

/// Stopped by Ctrl-C.
struct Interrupted {};

/// Its own folder unless the user wants to keep it.
class ReplayFolder {
 public:
  ReplayFolder(const fs::path& session, const fs::path& kept) : keep_(!kept.empty()) {
    path_ = kept;
    if (!keep_) path_ = session.string() + ".replay-" + std::to_string(::getpid());
    check_outside(path_, session);
    if (fs::exists(path_)) throw InputError(path_, "exists already, expected a new directory for the replayed session");
  }
  ~ReplayFolder() {
    std::error_code ignored;
    if (!keep_) fs::remove_all(path_, ignored);
  }
  ReplayFolder(const ReplayFolder&) = delete;
  ReplayFolder& operator=(const ReplayFolder&) = delete;
  const fs::path& path() const { return path_; }
  bool kept() const { return keep_; }

 private:
  bool keep_;
  fs::path path_;
};

class WriterSink final : public ScanSink {
 public:
  explicit WriterSink(SessionWriter& writer) : writer_(writer) {}
  void joints(const JointState& state) override { writer_.joints(state); }
  void frame(const FrameRecord& record, const cv::Mat& image) override { writer_.frame(record, image); }
  void event(Stamp when, std::string_view kind, const std::string& text) override { writer_.event(when, kind, text); }

 private:
  SessionWriter& writer_;
};

bool is_one_of(const std::string& name, const std::vector<std::string>& parts) {
  return std::any_of(parts.begin(), parts.end(),
                     [&](const std::string& part) { return name == part || name.starts_with(part + "/"); });
}

/// Copies what a replay needs and does not make: rig file, plan, object, cameras, the wire's log.
void take_over(const Session& session, const fs::path& to, bool fed) {
  for (const std::string& name : files_of(session.path)) {
    if (is_one_of(name, kMade) || (fed && is_one_of(name, kFed))) continue;
    fs::create_directories((to / name).parent_path());
    copy_whole_file(session.path / name, to / name);
  }
}

/// Returns when `stamp` is due at the speed asked for.
class Pace {
 public:
  explicit Pace(double speed) : speed_(speed) {}
  void wait_for(Stamp stamp) {
    if (speed_ <= 0) return;
    if (!first_) first_ = stamp, began_ = clock_.now();
    clock_.sleep_until(began_ + from_seconds(seconds(stamp - *first_) / speed_));
  }

 private:
  double speed_;
  MonotonicClock clock_;
  std::optional<Stamp> first_;
  Stamp began_{};
};

/// The recorded scan into a new session at `to`, by way of joiner and recorder.
ReplayCounts feed(const Session& session, const SessionReplayOptions& options, const fs::path& to, Progress& progress) {
  const RecordedScan recorded = read_recorded_scan(session);
  const ScanSettings settings = read_rig(session_rig_file(session.path)).scan;
  SessionWriterOptions writer_options;
  writer_options.wait_when_full = options.speed <= 0;
  SessionInfo info = session.info;
  info.status.clear();
  SessionWriter writer(to, std::move(info), writer_options);
  take_over(session, to, true);
  WriterSink sink(writer);
  Pace pace(options.speed);
  const double length = recorded.joints.empty() ? 0 : seconds(recorded.joints.back().stamp - recorded.joints[0].stamp);
  const ReplayCounts counts = replay_scan(session, recorded, settings, sink, [&](Stamp stamp) {
    if (StopOnSignal::requested()) throw Interrupted{};
    pace.wait_for(stamp);
    progress.update("replay", length > 0 ? seconds(stamp - recorded.joints[0].stamp) / length : 1);
  });
  writer.close(session.info.status);
  copy_whole_file(session.path / "session.yaml",
                  to / "session.yaml");  // a calibration read and written is not the same bits
  return counts;
}

void compare_recording(const Session& session, const fs::path& replayed, Comparison& verdict) {
  for (const char* table : {"joints.csv", "frames.csv"}) verdict.compare(session.path, replayed, table, verdict.tables);
  for (const FrameRecord& frame : session.frames) verdict.compare(session.path, replayed, frame.file, verdict.images);
}

bool has_clouds(const Session& session) {
  return std::any_of(kMethods.begin(), kMethods.end(), [&](const std::string& method) {
    return fs::exists(session.path / "clouds" / (method + ".ply"));
  });
}

/// Clouds, and scores where there is an object.
void make_clouds(const Session& replayed, Progress& progress) {
  const PipelineParameters parameters = pipeline_parameters(replayed);
  if (replayed.info.object) {
    const ObjectSurface object = object_of(replayed, parameters.thresholds);
    reconstruct_and_score(replayed, parameters, object, StopOnSignal::requested(), progress.callback());
  } else {
    for (const std::string& method : kMethods)
      if (has_cameras(replayed, method) && !StopOnSignal::requested())
        write_clouds(replayed, reconstruct_session(replayed, parameters, method, progress.callback()));
  }
  if (StopOnSignal::requested()) throw Interrupted{};
}

void compare_results(const Session& session, const fs::path& replayed, Comparison& verdict) {
  for (const std::string& method : kMethods) {
    for (const char* extension : {".ply", ".pcd"})
      verdict.compare(session.path, replayed, "clouds/" + method + extension, verdict.clouds);
    verdict.compare(session.path, replayed, "results/" + method + ".json", verdict.scores);
    if (by_laser(method))
      verdict.compare(session.path, replayed, fs::relative(stripe_file(session, method), session.path), verdict.clouds);
  }
}

struct Replayed {
  std::string not_fed;  ///< why joints and frames were not fed again; empty: they were
  bool clouds = false;
  ReplayCounts counts;
  Comparison verdict;
};

Replayed replay(const OpenedSession& opened, const SessionReplayOptions& options, const fs::path& to,
                Progress& progress) {
  const Session& session = opened.session;
  Replayed result;
  result.verdict.differences = opened.unlike_seal;
  result.not_fed = why_not_replayable(session);
  result.clouds = has_clouds(session);
  if (result.not_fed.empty()) {
    result.counts = feed(session, options, to, progress);
    compare_recording(session, to, result.verdict);
  } else {
    take_over(session, to, false);
  }
  if (result.clouds) {
    make_clouds(Session::open(to), progress);
    compare_results(session, to, result.verdict);
  }
  return result;
}

nlohmann::ordered_json json_of(const Replayed& r, const Session& session) {
  nlohmann::ordered_json out{{"session", session.path.string()},
                             {"identical", r.verdict.differences.empty()},
                             {"differences", r.verdict.differences},
                             {"fed", r.not_fed.empty()},
                             {"joints", r.counts.joints},
                             {"frames", r.counts.frames},
                             {"identical_tables", r.verdict.tables},
                             {"identical_images", r.verdict.images},
                             {"identical_clouds", r.verdict.clouds},
                             {"identical_scores", r.verdict.scores}};
  if (!r.not_fed.empty()) out["not_fed"] = r.not_fed;
  return out;
}

void print(const Replayed& r, const Session& session) {
  const Comparison& v = r.verdict;
  if (r.not_fed.empty())
    std::printf("%zu joint samples and %zu frames fed again: %zu tables and %zu images identical\n", r.counts.joints,
                r.counts.frames, v.tables, v.images);
  else
    std::printf("joints and frames not fed again: the session %s\n", r.not_fed.c_str());
  if (r.clouds)
    std::printf("%zu cloud files and %zu scores identical\n", v.clouds, v.scores);
  else
    std::printf("clouds and scores: none in the session\n");
  for (const std::string& difference : v.differences) std::printf("differs: %s\n", printable(difference).c_str());
  for (const auto& [reason, count] : r.counts.refused)
    std::printf("refused now: %s %llu\n", reason.c_str(), static_cast<unsigned long long>(count));
  if (!v.differences.empty() && session.info.software != TANKRIG_VERSION)
    std::printf("recorded by tankrig %s, replayed by %s\n", printable(session.info.software).c_str(), TANKRIG_VERSION);
  std::printf("%s\n", v.differences.empty() ? "identical" : "NOT identical");
}

/// kOk: identical. kFailure: something differs, named. kPartial: stopped.
int replay_session(const SessionReplayOptions& options) {
  Progress progress;
  const StopOnSignal stop_on_signal;
  const OpenedSession opened = open_with_warnings(options.session, progress);
  const Session& session = opened.session;
  if (session.info.status == "recording" || !spool_segments(session.path).empty())
    throw InputError(session.path, "was cut short: tankrig session recover it first, then replay what was recovered");
  const ReplayFolder folder(session.path, options.out);
  try {
    const Replayed result = replay(opened, options, folder.path(), progress);
    progress.finish_line();
    const nlohmann::ordered_json json = json_of(result, session);
    if (folder.kept()) {
      write_file_durably(folder.path() / "replay.json", json.dump(2) + "\n");
      write_checksums(folder.path());
    }
    if (options.json)
      print_json(json);
    else
      print(result, session);
    return result.verdict.differences.empty() ? kOk : kFailure;
  } catch (const Interrupted&) {
    progress.warn("replay stopped");
    return kPartial;
  }
}

}  // namespace

void add_session_replay(CLI::App& session, ChosenCommand& chosen) {
  CLI::App* c = session.add_subcommand(
      "replay", "Run a recording through the same code again, and compare the results byte for byte");
  SessionReplayOptions& o = options_of(c, chosen, &replay_session);
  c->footer("Example: tankrig session replay sessions/monday");
  add_session_option(c, o.session);
  c->add_option("--out", o.out, "Folder to make: keep the replayed session there (default: remove it afterwards)");
  c->add_option("--speed", o.speed,
                "Pace relative to the recording; a slow disk then drops frames (default: as fast as possible)")
      ->check(CLI::PositiveNumber);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
