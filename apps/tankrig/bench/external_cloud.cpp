#include "apps/tankrig/bench/external_cloud.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "apps/tankrig/bench/scratch_folder.hpp"
#include "bench/external/limited_run.hpp"
#include "bench/external/sandbox.hpp"
#include "core/camera_file.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "session/reading/session_tables.hpp"
#include "session/reading/session_yaml.hpp"
#include "session/recording/png_file.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

constexpr std::size_t kMostPoints = 5'000'000;

/// Its cloud in b; frames that the session does not have become unknown.
/// Errors: InputError, whose message does not name the folder.
PointCloud cloud_of_program(const fs::path& file, const Session& session, bool laser) {
  std::error_code unreachable;
  const fs::file_status status = fs::symlink_status(file, unreachable);
  if (!fs::exists(status)) throw InputError("wrote no cloud, expected one at its last argument");
  if (!fs::is_regular_file(status)) throw InputError("its cloud is no regular file");
  PointCloud cloud = cloud_from_others(file);
  std::set<std::int64_t> frames;
  if (laser)
    for (const FrameRecord& frame : session.frames)
      if (frame.camera == session.camera(CameraRole::kMono).name) frames.insert(static_cast<std::int64_t>(frame.index));
  for (CloudPoint& point : cloud.points)
    if (!frames.contains(point.frame)) point.frame = -1;
  return cloud;
}

/// The beginning of what a program printed; no more of it than one reads.
void keep_log(const fs::path& output, const fs::path& log) {
  constexpr std::size_t kMostLog = 256 << 10;
  std::string text(kMostLog, '\0');
  std::ifstream file(output, std::ios::binary);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
  write_whole_file(log, text);
}

/// As external_reconstruction(), with the folder that it works in.
Reconstruction run_in(const fs::path& place, const Algorithm& algorithm, const GivenSession& given,
                      const std::optional<WorkspaceBox>& workspace, const std::atomic<bool>& stop,
                      const std::optional<Stranger>& stranger) {
  const Session& session = given.session;
  Reconstruction out;
  out.method = algorithm.name;
  out.cloud.frame = "b";
  const fs::path folder = place / "session", work = place / "work";
  fs::path cloud = work / "cloud.ply";
  fs::create_directories(work);
  write_given_session(folder, given, algorithm.by_laser, !algorithm.by_laser);
  LimitedRun run{{algorithm.program.string()}, place, algorithm.limits};
  run.command.insert(run.command.end(), algorithm.arguments.begin(), algorithm.arguments.end());
  run.command.insert(run.command.end(), {folder.string(), cloud.string()});
  if (stranger) {
    const fs::path result = place / "cloud.ply";
    write_whole_file(result, "");
    fs::permissions(result, fs::perms(0666));
    fs::permissions(place, fs::perms(0755));
    run.command = sandboxed(
        {{folder, stranger->folder}, work, algorithm.limits.disk_bytes, cloud, result, place / "filter"}, run.command);
    cloud = result;
  }
  out.reason = run_limited({"tankrig", "bench", kProgramCommand}, run, stop);
  if (stranger) {
    keep_log(place / "output.txt", stranger->log);
    if (out.reason.empty() && fs::file_size(cloud) == 0) fs::remove(cloud);  // it left none
  }
  if (!out.reason.empty()) {
    const std::string said = last_words(run, stranger ? stranger->folder : fs::path());
    if (!said.empty()) out.reason += ": " + said;
    return out;
  }
  try {
    out.cloud = cloud_of_program(cloud, session, algorithm.by_laser);
  } catch (const InputError& e) {
    out.reason = shown_text(e.what(), 300);  // it may quote the program's bytes
    return out;
  }
  if (out.cloud.points.empty()) {
    out.warning = "it found no points";
    return out;
  }
  if (workspace)
    out.rejected = std::erase_if(out.cloud.points, [&](const CloudPoint& p) { return !contains(*workspace, p.p); });
  if (out.cloud.points.empty()) out.reason = "its cloud has no point in the workspace";
  if (out.cloud.invalid > 0) out.warning = fmt::format("{} points were not finite and are left out", out.cloud.invalid);
  return out;
}

}  // namespace

PointCloud cloud_from_others(const fs::path& file) {
  PointCloud cloud;
  try {
    cloud = read_cloud(file);
  } catch (const InputError& e) {
    std::string what = e.what();
    if (what.starts_with(file.string())) what.erase(0, file.parent_path().string().size() + 1);
    throw InputError(what);
  }
  if (!cloud.frame.empty() && cloud.frame != "b")
    throw InputError("its cloud is in the frame " + shown_text(cloud.frame) + ", expected b, the arm's base");
  if (cloud.points.size() > kMostPoints)
    throw InputError(fmt::format("its cloud has {} points, expected at most {}", cloud.points.size(), kMostPoints));
  if (cloud.points.empty() && cloud.invalid > 0)
    throw InputError(fmt::format("none of its {} points is finite", cloud.invalid));
  cloud.frame = "b";
  return cloud;
}

void write_given_session(const fs::path& folder, const GivenSession& given, bool laser, bool stereo) {
  const Session& session = given.session;
  SessionInfo info = session.info;
  info.object.reset();
  std::erase_if(info.cameras,
                [&](const CalibratedCamera& c) { return c.role == CameraRole::kMono ? !laser : !stereo; });
  std::erase_if(info.account, [&](const auto& entry) { return !info.has_camera(entry.first); });
  std::erase_if(info.counts, [&](const auto& entry) {
    const std::string camera = entry.first.substr(0, entry.first.find('.'));
    return session.info.has_camera(camera) && !info.has_camera(camera);
  });
  const CalibratedCamera* const laser_camera = session.find_camera(CameraRole::kMono);
  const std::string mono = laser_camera ? laser_camera->name : "";
  std::string frames = frames_header(), joints = joints_header();
  for (const JointState& state : given.joints) joints += joints_line(state);
  for (const CalibratedCamera& camera : info.cameras) fs::create_directories(folder / "frames" / camera.name);
  for (FrameRecord frame : session.frames) {
    if (!info.has_camera(frame.camera)) continue;
    if (frame.q && frame.camera == mono) frame.cPl = session.laser_plane(frame);
    frames += frames_line(frame);
    const fs::path file = folder / frame.file;
    write_whole_file(file, png_of(session.image(frame), file));
  }
  fs::create_directories(folder / "cameras");
  for (const CalibratedCamera& camera : info.cameras) write_camera_files(folder / "cameras", camera.model, camera.name);
  write_whole_file(folder / "frames.csv", frames);
  write_whole_file(folder / "joints.csv", joints);
  write_whole_file(folder / "rig.yaml", given.rig_yaml);
  write_whole_file(folder / "session.yaml", session_yaml(info));
}

std::optional<fs::path> program_file(const fs::path& named, const fs::path& folder) {
  const auto runs = [](const fs::path& file) {
    std::error_code unreachable;
    return fs::is_regular_file(file, unreachable) && ::access(file.c_str(), X_OK) == 0;
  };
  if (named.has_parent_path()) {
    const fs::path file = fs::absolute(folder / named).lexically_normal();
    return runs(file) ? std::optional(file) : std::nullopt;
  }
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/bin:/bin");
  for (std::string one; std::getline(folders, one, ':');)
    if (fs::path(one).is_absolute() && runs(one / named)) return one / named;
  return std::nullopt;
}

Reconstruction external_reconstruction(const Algorithm& algorithm, const GivenSession& given,
                                       const std::optional<WorkspaceBox>& workspace, const std::atomic<bool>& stop,
                                       const std::optional<Stranger>& stranger) {
  ScratchFolder scratch("tankrig-algorithm");
  Reconstruction out = run_in(scratch.path(), algorithm, given, workspace, stop, stranger);
  if (!scratch.remove())
    out.warning += (out.warning.empty() ? "" : "; ") + scratch.path().string() + " cannot be removed";
  return out;
}

}  // namespace tankrig::app
