#include "session/reading/session.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "session/reading/picture_file.hpp"
#include "session/reading/session_folder.hpp"
#include "session/reading/session_tables.hpp"
#include "session/reading/session_yaml.hpp"
#include "session/recording/spool.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

void check_cameras(const Session& session) {
  for (const FrameRecord& frame : session.frames)
    if (!session.info.has_camera(frame.camera))
      throw InputError(session.path / "frames.csv",
                       "camera: found '" + frame.camera + "', expected a camera of session.yaml");
}

/// A recording that was cut, or ran out of disk, can list frames whose images were never written.
void drop_frames_without_image(Session& session) {
  const std::size_t listed = session.frames.size();
  std::erase_if(session.frames, [&](const FrameRecord& frame) {
    return !session.unwritten.contains(frame.file) && !fs::exists(session.path / frame.file);
  });
  if (const std::size_t lost = listed - session.frames.size())
    session.lose(fmt::format("{} frames of {} in frames.csv have no image and are left out", lost, listed));
}

}  // namespace

bool SessionInfo::has_camera(const std::string& camera) const {
  return std::any_of(cameras.begin(), cameras.end(),
                     [&](const CalibratedCamera& known) { return known.name == camera; });
}

std::string lines_missing(const SessionInfo& info, const std::string& table, std::size_t found) {
  const auto span = info.tables.find(table);
  if (span == info.tables.end() || found >= span->second.lines) return "";
  return fmt::format("{}.csv: {} of {} {} there", table, found, span->second.lines,
                     span->second.lines == 1 ? "line" : "lines");
}

Session Session::open(const fs::path& path, std::map<std::string, cv::Mat> unwritten) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) throw InputError(path, "is not a folder, expected a session");
  refuse_links(path);
  if (!fs::exists(path / "session.yaml", ignored)) throw InputError(path, "has no session.yaml, expected a session");
  Session session;
  session.path = path;
  session.unwritten = std::move(unwritten);
  session.info = read_session_yaml(path / "session.yaml");
  const bool unfinished = session.info.status == "recording";
  if (unfinished) session.lose("the recording was cut short: it never reached its end");
  if (!calibration_is_as_recorded(path / "session.yaml", session.info))
    session.warnings.push_back("calibration in session.yaml was changed after the recording: its SHA-256 differs");

  auto table = read_frames_csv(path / "frames.csv", unfinished);
  session.frames = std::move(table.records);
  if (table.cut_short) session.lose("frames.csv: its last line is incomplete and left out");
  if (const std::string missing = lines_missing(session.info, "frames", session.frames.size()); !missing.empty())
    session.lose(missing);
  check_cameras(session);
  if (session.info.status != "complete" || has_spool(path)) drop_frames_without_image(session);
  if (session.unwritten.empty() && !spool_segments(path).empty())
    session.lose("frames in the spool are not pictures yet: tankrig session recover " + path.string());
  return session;
}

const CalibratedCamera* Session::find_camera(CameraRole role) const {
  for (const CalibratedCamera& camera : info.cameras)
    if (camera.role == role) return &camera;
  return nullptr;
}

const CalibratedCamera& Session::camera(CameraRole role) const {
  if (const CalibratedCamera* camera = find_camera(role)) return *camera;
  throw InputError(path / "session.yaml",
                   std::string("cameras: found no ") + to_string(role) + " camera, expected one");
}

cv::Mat Session::image(const FrameRecord& frame) const {
  if (const auto found = unwritten.find(frame.file); found != unwritten.end()) return found->second;
  const fs::path file = path / frame.file;
  std::error_code ignored;
  if (!fs::exists(file, ignored))
    throw InputError(file,
                     "does not exist, expected the image of a frame of frames.csv; a session of what is left: "
                     "tankrig session recover " +
                         path.string());
  const auto camera = std::find_if(info.cameras.begin(), info.cameras.end(),
                                   [&](const CalibratedCamera& c) { return c.name == frame.camera; });
  if (camera == info.cameras.end()) throw InputError(file, "is of no camera of session.yaml, expected one of those");
  const ExpectedSize expected{camera->model.width, camera->model.height, "as calibrated"};
  return decode_picture(read_below(path, frame.file, kMostPictureBytes, "an image"), file, &expected,
                        cv::IMREAD_ANYCOLOR | cv::IMREAD_IGNORE_ORIENTATION);
}

Plane Session::laser_plane(const FrameRecord& frame) const {
  if (frame.cPl) return *frame.cPl;
  const std::string name = fmt::format("frame {} of {}: ", frame.index, frame.camera);
  if (!frame.q)
    throw InputError(path / "frames.csv", name + "found no joints and no laser plane, expected one of them");
  if (!info.calibration.arm || !info.calibration.ePl)
    throw InputError(
        path / "session.yaml",
        "calibration: found no arm or no ePl, expected both to place the laser of " + name + "no plane of its own");
  for (const CalibratedCamera& camera : info.cameras)
    if (camera.name == frame.camera)
      return (camera.bMc.inverse() * info.calibration.arm->bMe(*frame.q)) * *info.calibration.ePl;
  throw InputError(path / "frames.csv", name + "expected a camera of session.yaml");
}

}  // namespace tankrig
