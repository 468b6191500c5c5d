#include "session/checking/session_findings.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "core/regular_file.hpp"
#include "session/checking/checksums.hpp"
#include "session/checking/session_facts.hpp"
#include "session/checking/sha256.hpp"
#include "session/reading/picture_file.hpp"
#include "session/reading/session_folder.hpp"
#include "session/recording/png_file.hpp"
#include "session/recording/spool.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using Kind = ChecksumDifference::Kind;

std::string plural(std::size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

std::string seconds_text(Duration time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", seconds(time));
  return text;
}

std::string span_text(Stamp zero, Stamp from, Stamp to) {
  return "from " + seconds_text(from - zero) + " to " + seconds_text(to - zero);
}

bool has_check_sums(const fs::path& picture) { return picture.extension() == ".png"; }

bool is_whole_picture(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  try {
    const std::string bytes = read_regular_file(file, kMostPictureBytes, "an image");
    if (has_check_sums(file)) return is_whole_png(bytes);
    decode_picture(bytes, file, nullptr, cv::IMREAD_ANYCOLOR | cv::IMREAD_IGNORE_ORIENTATION);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

class Examination {
 public:
  Examination(const fs::path& session, const DescribeRig& describe) : session_(session), describe_(describe) {}

  SessionFindings run() {
    examine_session_yaml(session_, describe_, out_);
    if (out_.info_damaged) told_.insert("session.yaml");
    if (out_.info.status == "recording" && !out_.info_damaged)
      out_.losses.push_back("session.yaml: the recording never reached its end");
    read_seal();
    read_tables();
    read_spool();
    keep_frames_with_pictures();
    set_strays_aside();
    compare_lengths();
    compare_accounts();
    compare_rest();
    return std::move(out_);
  }

 private:
  bool of_this_session(const FrameRecord& frame) const {
    return out_.info.cameras.empty() || out_.info.has_camera(frame.camera);
  }

  std::optional<FrameRecord> frame_from(const std::string& line) const {
    auto frame = parse_frames_line(line);
    return frame && of_this_session(*frame) ? std::move(frame) : std::nullopt;
  }

  void read_seal() {
    std::error_code ignored;
    out_.sealed = fs::exists(session_ / "SHA256SUMS", ignored);
    if (!out_.sealed) {
      out_.undone.push_back("SHA256SUMS: there is none, the session was never sealed");
      return;
    }
    try {
      for (const auto& [file, kind] : compare_checksums(session_)) differs_[file] = kind;
      seal_read_ = true;
    } catch (const InputError& e) {
      lose("SHA256SUMS", "cannot be read (" + within(session_, e.what()) + ")");
    }
  }

  void read_tables() {
    out_.joints = salvage_table<JointState>(session_ / "joints.csv", joints_header(), read_joints_csv,
                                            parse_joints_line, joints_line);
    out_.events =
        salvage_table<SessionEvent>(session_ / "events.csv", events_header(), read_events_csv, parse_events_line,
                                    [](const SessionEvent& e) { return events_line(e.stamp, e.kind, e.text); });
    out_.frames = salvage_table<FrameRecord>(
        session_ / "frames.csv", frames_header(),
        [&](const fs::path& file, bool recording) {
          auto table = read_frames_csv(file, recording);
          for (const FrameRecord& frame : table.records)
            if (!of_this_session(frame)) throw InputError(file, "a frame of no camera of session.yaml");
          return table;
        },
        [&](const std::string& line) { return frame_from(line); }, frames_line);
    tell_table("joints.csv", out_.joints);
    tell_table("events.csv", out_.events);
    tell_table("frames.csv", out_.frames);
  }

  template <class Table>
  void tell_table(const std::string& file, const Table& table) {
    if (!table.damaged) return;
    if (table.missing)
      lose(file, "missing");
    else if (table.bad_lines > 0)
      lose(file, plural(table.bad_lines, "line") + " cannot be read and " + (table.bad_lines == 1 ? "is" : "are") +
                     " left out");
    else
      lose(file, "its header is damaged");
  }

  /// Frames of the spool, whole; those that frames.csv had no time for join its lines.
  void read_spool() {
    std::set<std::string> known;
    for (const FrameRecord& frame : out_.frames.records) known.insert(frame.file);
    for (const fs::path& file : spool_segments(session_)) try {
        read_segment(file, known);
      } catch (const InputError& e) {
        out_.set_aside.insert(file.lexically_relative(session_).generic_string());
        lose(fs::path("spool") / file.filename(), "cannot be read (" + within(session_, e.what()) + ")");
      }
    out_.spooled = in_spool_.size();
    if (out_.spooled > 0)
      out_.undone.push_back("spool: " + plural(out_.spooled, "frame") + " not made into pictures yet");
  }

  void read_segment(const fs::path& file, std::set<std::string>& known) {
    const SpoolSegment segment(file);
    std::size_t strange = 0;
    for (const SpooledFrame& spooled : segment.frames()) {
      auto frame = frame_from(spooled.line);
      if (!frame || !in_spool_.insert(frame->file).second) {
        ++strange;
        continue;
      }
      if (!known.insert(frame->file).second) continue;
      const bool as_written_now = out_.frames.text.starts_with(frames_header());
      out_.frames.text += as_written_now ? frames_line(*frame) : spooled.line;
      out_.frames.records.push_back(std::move(*frame));
      out_.frames.damaged = true;
    }
    const fs::path name = fs::path("spool") / file.filename();
    if (segment.stray_bytes() > 0) lose(name, std::to_string(segment.stray_bytes()) + " bytes are of no whole frame");
    if (strange > 0) lose(name, plural(strange, "frame") + " without a proper line of its own");
  }

  void keep_frames_with_pictures() {
    const std::vector<FrameRecord>& all = out_.frames.records;
    frame_lines_ = all.size();
    std::vector<char> whole(all.size());
    tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
      const fs::path file = session_ / all[i].file;
      const bool unlike_seal = differs_.contains(all[i].file);
      const bool as_sealed = seal_read_ && !unlike_seal && fs::exists(file);
      // A seal with a wrong sum does not condemn a PNG: that has sums of its own.
      const bool whole_alone = (!unlike_seal || has_check_sums(file)) && is_whole_picture(file);
      whole[i] = in_spool_.contains(all[i].file) || as_sealed || whole_alone;
    });
    std::map<std::string, std::vector<const FrameRecord*>> lost;
    std::error_code ignored;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (whole[i]) continue;
      lost[all[i].camera].push_back(&all[i]);
      if (fs::exists(session_ / all[i].file, ignored)) out_.set_aside.insert(all[i].file);
    }
    for (const auto& [camera, frames] : lost) tell_lost_frames(camera, frames);
    if (!lost.empty()) leave_out(whole);
  }

  void tell_lost_frames(const std::string& camera, const std::vector<const FrameRecord*>& frames) {
    constexpr std::size_t kNamed = 8;
    std::string indices;
    for (std::size_t i = 0; i < std::min(frames.size(), kNamed); ++i)
      indices += (i ? ", " : "") + std::to_string(frames[i]->index);
    if (frames.size() > kNamed) indices += ", ...";
    for (const FrameRecord* frame : frames) told_.insert(frame->file);
    const auto [first, last] = std::minmax_element(frames.begin(), frames.end(),
                                                   [](const auto* a, const auto* b) { return a->stamp < b->stamp; });
    out_.losses.push_back("camera " + camera + ": " + plural(frames.size(), "frame") + " without a whole picture, " +
                          span_text(zero(), (*first)->stamp, (*last)->stamp) + ": " + indices);
  }

  void leave_out(const std::vector<char>& whole) {
    std::size_t line = 0;
    std::vector<FrameRecord> kept;
    const std::string& old = out_.frames.text;
    std::size_t begin = old.find('\n') + 1;
    std::string text = old.substr(0, begin);
    for (; line < whole.size(); ++line) {
      const std::size_t end = old.find('\n', begin) + 1;
      if (whole[line]) text += old.substr(begin, end - begin), kept.push_back(out_.frames.records[line]);
      begin = end;
    }
    out_.frames.text = std::move(text);
    out_.frames.records = std::move(kept);
    out_.frames.damaged = true;
  }

  /// Pictures of no line, and files that were never finished.
  void set_strays_aside() {
    std::set<std::string> known;
    for (const FrameRecord& frame : out_.frames.records) known.insert(frame.file);
    std::size_t pictures = 0;
    std::error_code none;
    for (const auto& entry : fs::recursive_directory_iterator(session_ / "frames", none)) {
      const std::string file = entry.path().lexically_relative(session_).generic_string();
      if (!entry.is_regular_file() || known.contains(file) || out_.set_aside.contains(file)) continue;
      out_.set_aside.insert(file);
      told_.insert(file);
      if (entry.path().extension() != kUnfinished) ++pictures;
    }
    if (pictures > 0) out_.losses.push_back("frames: " + plural(pictures, "picture") + " of no line in frames.csv");
  }

  /// Against what session.yaml says was recorded.
  void compare_lengths() {
    const auto compare = [&](const char* table, std::size_t found, Stamp last) {
      std::string text = lines_missing(out_.info, table, found);
      if (text.empty()) return;
      const TableSpan& span = out_.info.tables.at(table);
      if (found == 0)
        text += ", all lost " + span_text(zero(), span.first, span.last);
      else if (last < span.last)
        text += ", the end lost " + span_text(zero(), last, span.last);
      told_.insert(std::string(table) + ".csv");
      out_.losses.push_back(text);
    };
    const auto last = [](const auto& table) { return table.records.empty() ? Stamp{} : table.records.back().stamp; };
    compare("joints", out_.joints.records.size(), last(out_.joints));
    compare("events", out_.events.records.size(), last(out_.events));
    compare("frames", frame_lines_, last(out_.frames));
    if (out_.info.tables.empty() && out_.info.status == "recording" && !out_.joints.records.empty())
      lose("joints.csv",
           "ends " + seconds_text(last(out_.joints) - zero()) + " after its first line; what came later is lost");
  }

  /// Frames of which nobody knows are a fault of the recording. Told no second time of a session that was recovered.
  void compare_accounts() {
    const auto& recovered = out_.info.recovered;
    for (const auto& [camera, account] : out_.info.account) {
      if (account.closes()) continue;
      const std::string loss = "camera " + camera + ": of " + std::to_string(account.expected) + " frames " +
                               (account.unaccounted > 0 ? std::to_string(account.unaccounted) +
                                                              " are neither recorded nor left out for a reason"
                                                        : std::to_string(-account.unaccounted) + " are counted twice");
      if (std::find(recovered.begin(), recovered.end(), loss) == recovered.end()) out_.losses.push_back(loss);
    }
  }

  /// What the seal says of the files nobody spoke of yet. What was made of a recording can be made again: no loss.
  void compare_rest() {
    std::vector<std::string> made_since, other, foreign;
    for (const auto& [file, kind] : differs_) {
      if (told_.contains(file)) continue;
      if (is_derived(file)) {
        (kind == Kind::kNotListed ? made_since : other).push_back(file);
        if (kind == Kind::kChanged) out_.set_aside.insert(file);
      } else if (kind == Kind::kNotListed) {
        if (!file.starts_with("spool/")) foreign.push_back(file);
      } else {
        lose(file, kind == Kind::kMissing ? "missing" : "changed since it was sealed");
      }
    }
    tell_files(made_since, "made from the recording after sealing; not sealed yet", out_.undone);
    tell_files(other, "not as sealed, can be made again from the recording", out_.undone);
    tell_files(foreign, "not listed in SHA256SUMS", out_.extra);
    compare_with_session_yaml();
  }

  void tell_files(const std::vector<std::string>& files, const std::string& what, std::vector<std::string>& list) {
    constexpr std::size_t kNamed = 5;
    for (std::size_t i = 0; i < std::min(files.size(), kNamed); ++i) list.push_back(files[i] + ": " + what);
    if (files.size() > kNamed) list.push_back(plural(files.size() - kNamed, "more file") + ": " + what);
  }

  /// Files that session.yaml knows without the seal. What `recover` could not bring back is told no second time.
  void compare_with_session_yaml() {
    std::error_code ignored;
    const auto there = [&](const std::string& file) { return fs::is_regular_file(session_ / file, ignored); };
    for (const std::string& loss : out_.info.recovered) told_.insert(loss.substr(0, loss.find(": ")));
    if (!out_.info.rig_hash.empty() && !told_.contains("rig.yaml")) {
      if (!there("rig.yaml"))
        lose("rig.yaml", "missing");
      else if (sha256_of_file(session_ / "rig.yaml") != out_.info.rig_hash)
        lose("rig.yaml", "not as recorded, its SHA-256 differs");
    }
    if (out_.info.object && !told_.contains(out_.info.object->mesh) && !there(out_.info.object->mesh))
      lose(out_.info.object->mesh, "missing");
  }

  void lose(const fs::path& file, const std::string& what) {
    told_.insert(file.generic_string());
    out_.losses.push_back(file.generic_string() + ": " + what);
  }

  /// Time zero of what is told: the first joint sample, or frame.
  Stamp zero() const {
    if (const auto span = out_.info.tables.find("joints"); span != out_.info.tables.end()) return span->second.first;
    if (!out_.joints.records.empty()) return out_.joints.records.front().stamp;
    return out_.frames.records.empty() ? Stamp{} : out_.frames.records.front().stamp;
  }

  const fs::path& session_;
  const DescribeRig& describe_;
  SessionFindings out_;
  std::map<std::string, Kind> differs_;
  bool seal_read_ = false;
  std::set<std::string> in_spool_;
  std::size_t frame_lines_ = 0;  ///< with a picture or without
  std::set<std::string> told_;   ///< files whose damage is in the losses already
};

}  // namespace

std::vector<std::string> SessionFindings::missing() const {
  std::vector<std::string> out;
  if (!info_known) out.emplace_back("cameras and calibration, which neither session.yaml nor rig.yaml tells");
  if (frames.records.empty() && joints.records.empty())
    out.emplace_back("a frame with its picture, or a joint sample: there is none");
  return out;
}

SessionFindings examine_session(const fs::path& session, const DescribeRig& describe) {
  std::error_code ignored;
  if (!fs::is_directory(session, ignored)) throw InputError(session, "is not a folder, expected a session");
  refuse_links(session);
  return Examination(session, describe).run();
}

}  // namespace tankrig
