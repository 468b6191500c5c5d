// `tankrig session export`: a session for other programs.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/session/open_session.hpp"
#include "apps/tankrig/session/session_bag.hpp"
#include "core/camera_file.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "core/text_files.hpp"
#include "drivers/can/can_log.hpp"
#include "session/export/export_candump.hpp"
#include "session/export/export_csv.hpp"
#include "session/export/rosbag/bag_file.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct SessionExportOptions {
  std::filesystem::path session;
  std::vector<std::string> formats;  ///< candump, camera_info, csv, bag
  bool all = false;
  std::filesystem::path out;  ///< folder; empty: SESSION-export
  bool raw_images = false;    ///< in the bag: sensor_msgs/Image instead of the PNG files
  bool json = false;
};

const std::vector<std::string> kFormats{"candump", "camera_info", "csv", "bag"};

class Export {
 public:
  Export(const SessionExportOptions& options, Progress& progress)
      : options_(options),
        progress_(progress),
        opened_(open_with_warnings(options.session, progress)),
        out_(options.out.empty() ? fs::path(options.session.string() + "-export") : options.out) {
    check_outside(out_, session_.path);
    if (!joints_.empty())
      start_ = joints_.front().stamp;
    else if (!session_.frames.empty())
      start_ = session_.frames.front().stamp;
  }

  void run(const std::string& format) {
    progress_.update("export " + format, 0);
    if (format == "candump") candump();
    if (format == "camera_info") camera_info();
    if (format == "csv") csv();
    if (format == "bag") bag();
    progress_.update("export " + format, 1);
  }

  /// With --all, what this session or this build does not have is left out, and said.
  void run_all() {
    for (const std::string& format : kFormats) try {
        run(format);
      } catch (const InputError& e) {
        left_out_[format] = e.what();
      }
  }

  const std::vector<std::string>& written() const { return written_; }
  const std::map<std::string, std::string>& left_out() const { return left_out_; }
  /// Nothing that was recorded is known to be missing from what was written.
  bool all_there() const { return session_.all_there && !can_log_cut_; }

 private:
  /// Errors: InputError if it is there already.
  fs::path unwritten(const std::string& name) const {
    const fs::path file = out_ / name;
    if (fs::exists(file)) throw InputError(file, "exists already, expected another folder: --out");
    return file;
  }

  fs::path target(const std::string& name) {
    const fs::path file = unwritten(name);
    fs::create_directories(file.parent_path());
    written_.push_back(file.string());
    return file;
  }

  void candump() {
    const fs::path log = session_.path / "can.log";
    if (fs::exists(log)) {
      std::string text;
      const CanLog recorded = read_can_log(log);
      if (recorded.cut_bytes > 0) {
        progress_.warn("can.log: its last line is incomplete and left out");
        can_log_cut_ = true;
      }
      for (const CanLogEntry& entry : recorded.entries) {
        append_line(entry, text);
        text += '\n';
      }
      write_file_durably(target("candump.log"), text);
      return;
    }
    if (joints_.empty())
      throw InputError(session_.path, "has neither can.log nor joints, expected one of them to write a candump log");
    progress_.note("candump: the arm was not on CAN; made up from joints.csv, on interface " +
                   std::string(kSynthesised));
    write_file_durably(target("candump_synthesised.log"),
                       synthesised_candump(joints_, ArmCanIds{}, 1'000'000, WallClock(session_, start_)));
  }

  void camera_info() {
    const auto rectified = rectifications(session_);
    for (const CalibratedCamera& camera : session_.info.cameras) {
      const fs::path file = target("camera_info/" + camera.name + ".yaml");
      if (camera.model.port) {
        write_camera_file(file, CameraFileFormat::kTankrig, {{camera.name, camera.model, {}, {}}});
        continue;
      }
      write_camera_file(file, camera.model, camera.name, rectified.at(camera.name));
      write_opencv_camera_file(target("camera_info/" + camera.name + ".opencv.yml"), camera.model, camera.name);
    }
  }

  void csv() {
    const WallClock clock(session_, start_);
    if (!joints_.empty()) write_file_durably(target("csv/joints.csv"), flat_joints_csv(joints_, start_, clock));
    write_file_durably(target("csv/frames.csv"), flat_frames_csv(session_, start_, clock));
    if (!events_.empty()) write_file_durably(target("csv/events.csv"), flat_events_csv(events_, start_, clock));
  }

  void bag() {
    const fs::path file = unwritten(session_.path.filename().string() + ".bag");
    write_session_bag(opened_, options_.raw_images, file);
    written_.push_back(file.string());
  }

  const SessionExportOptions& options_;
  Progress& progress_;
  const OpenedSession opened_;
  const Session& session_ = opened_.session;
  const std::vector<JointState>& joints_ = opened_.joints;
  const std::vector<SessionEvent>& events_ = opened_.events;
  const fs::path out_;
  Stamp start_{};
  bool can_log_cut_ = false;
  std::vector<std::string> written_;
  std::map<std::string, std::string> left_out_;
};

int export_session(const SessionExportOptions& options) {
  Progress progress;
  Export job(options, progress);
  if (options.all)
    job.run_all();
  else
    for (const std::string& format : options.formats) job.run(format);
  progress.finish_line();
  for (const auto& [format, why] : job.left_out()) progress.warn(format + " left out: " + why);
  if (options.json)
    print_json({{"written", job.written()}, {"left_out", job.left_out()}});
  else
    for (const std::string& file : job.written()) std::printf("%s\n", printable(file).c_str());
  if (!job.all_there()) progress.warn("what was recorded is not all there, see above");
  return job.left_out().empty() && job.all_there() ? kOk : kPartial;
}

}  // namespace

void add_session_export(CLI::App& session, ChosenCommand& chosen) {
  CLI::App* c = session.add_subcommand("export", "Export a session for other programs");
  SessionExportOptions& o = options_of(c, chosen, &export_session);
  c->footer("Example: tankrig session export sessions/monday --format bag");
  add_session_option(c, o.session);
  auto* what = c->add_option_group("what");
  what->add_option("--format", o.formats, "Format to write; repeat the option for more")
      ->check(CLI::IsMember(kFormats))
      ->delimiter(',');
  what->add_flag("--all", o.all, "All formats; names and leaves out those that this session or build cannot give");
  what->require_option(1);
  c->add_option("--out", o.out, "Folder to write to (default: SESSION-export); never overwrites a file");
  c->add_flag("--raw-images", o.raw_images, "Put uncompressed images into the bag instead of the PNG files");
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
