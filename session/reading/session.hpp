// The session on disk: written by a scan, read by everything after it.
//
//   session.yaml   who, when, rig, lux, seeds, versions, status; cameras, calibration, object
//   joints.csv     every joint sample
//   frames.csv     every frame with its joints and sync residual
//   events.csv     drops, overruns, faults, phases
//   frames/        <camera>/<index>.png
//   later: clouds/ results/ pictures/ report.html, and SHA256SUMS at the end
// Formats, columns and units: docs/reference/formats.md.
#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/arm_model.hpp"
#include "core/calibrated_camera.hpp"
#include "core/camera_model.hpp"
#include "core/frame_record.hpp"
#include "core/utc.hpp"
#include "session/reading/frame_account.hpp"
#include "session/reading/session_timing.hpp"

namespace tankrig {

/// The calibration a scan was made with.
struct SessionCalibration {
  std::optional<ArmModel> arm;  ///< none for an imported session
  std::optional<Plane> ePl;     ///< laser plane rigid with the end effector
  // What the laser can reach; triangulation does not use it.
  Vector3d laser_origin_e = Vector3d::Zero();      ///< projector's exit in e [m]
  Vector3d laser_direction_e = Vector3d::UnitZ();  ///< middle of the fan, unit, in the sheet
  double laser_fan = 0;                            ///< full opening angle [rad]
};

struct SessionObject {
  std::string mesh;                       ///< file name inside the session
  Transform bMo = Transform::Identity();  ///< mesh frame in the arm base
};

/// What the recorder was given for one table.
struct TableSpan {
  std::uint64_t lines = 0;
  Stamp first{}, last{};  ///< of its first and last line
};

/// The highest lux a session accepts [lx]; sunlight has 1e5.
inline constexpr double kMaxLux = 1e7;

/// session.yaml, whole.
struct SessionInfo {
  std::string name;
  std::string status;       ///< "recording" | "complete" | "stopped: REASON"
  std::string kind;         ///< "scan" | "import"
  std::string created_utc;  ///< ISO 8601, for people
  /// The run's clock and the wall clock, at the beginning and the end; no end under a virtual clock.
  std::optional<ClockPair> clock_begin, clock_end;
  std::string operator_name, notes;
  std::string commission;  ///< who tried the rig's protection when, and what was waived; empty where none is asked for
  std::string rig, rig_hash;     ///< rig's name; SHA-256 of the resolved rig file copied as rig.yaml
  std::string calibration_hash;  ///< SHA-256 of cameras, calibration and object as written; the writer fills it in
  std::string software;          ///< tankrig's version
  std::string noise;             ///< sensor model and parameters; "device" on a real rig
  std::uint64_t seed = 0;
  std::optional<double> light;              ///< simulated only
  std::optional<std::uint64_t> truth_seed;  ///< of a simulated rig that is not as its drawings say: which one
  std::string lux_source;                   ///< "meter", "hand", or empty where there is none
  std::optional<double> lux_before, lux_after;
  std::optional<double> lux_uncertainty;         ///< limit of error of either [lx], where the meter's is known
  double simulated_s = 0;                        ///< length of the run on its own clock
  FrameCounts counts;                            ///< every frame not used has a reason here
  std::map<std::string, CameraAccount> account;  ///< by camera; none in imports and sessions from before it was kept
  std::map<std::string, double> devices;         ///< what drivers counted and measured, by "DEVICE.NAME"
  std::optional<SessionTiming> timing;           ///< in real time only
  std::map<std::string, std::string> platform;   ///< what the machine was and granted, in real time only
  std::map<std::string, TableSpan> tables;       ///< "joints", "frames", "events": what must be in them
  std::vector<std::string> recovered;            ///< what was lost before `tankrig session recover` mended the session
  std::vector<CalibratedCamera> cameras;
  SessionCalibration calibration;
  std::optional<SessionObject> object;

  bool has_camera(const std::string& camera) const;
};

/// "TABLE.csv: N of M lines there" if fewer lines were found than session.yaml says; empty otherwise.
std::string lines_missing(const SessionInfo& info, const std::string& table, std::size_t found);

/// A session read back.
struct Session {
  std::filesystem::path path;
  SessionInfo info;
  std::vector<FrameRecord> frames;    ///< in file order
  std::vector<std::string> warnings;  ///< what was cut short, left out, or changed since the recording
  bool all_there = true;              ///< no frame of the recording is known to be missing from `frames`
  /// Images that are no files yet, by FrameRecord::file. Nobody may write to them.
  std::map<std::string, cv::Mat> unwritten;

  /// Adds a warning and clears all_there.
  void lose(const std::string& what) {
    warnings.push_back(what);
    all_there = false;
  }

  /// `unwritten`: images that its spool still holds, for a session that was recorded a moment ago.
  /// Errors: InputError naming file, line, field.
  static Session open(const std::filesystem::path& path, std::map<std::string, cv::Mat> unwritten = {});

  const CalibratedCamera& camera(CameraRole role) const;  ///< InputError if there is none
  const CalibratedCamera* find_camera(CameraRole role) const;
  cv::Mat image(const FrameRecord& frame) const;  ///< InputError if missing or unreadable
  /// Laser plane in the frame of `frame`'s camera: given per frame, or cMb * bMe(q) * ePl.
  /// Errors: InputError if neither is known.
  Plane laser_plane(const FrameRecord& frame) const;
};

}  // namespace tankrig
