// One frame of a scan as a record: the recorder writes it, every method reads it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/arm_model.hpp"
#include "core/enum_names.hpp"
#include "core/frames.hpp"
#include "core/time.hpp"

namespace tankrig {

/// Where in the scan a frame was taken. Dark blocks have the laser off and the arm at rest.
enum class Phase : std::uint8_t { kMove, kDarkBefore, kSweep, kDarkAfter };
template <>
inline constexpr std::array kNames<Phase>{"move", "dark_before", "sweep", "dark_after"};
const char* to_string(Phase phase);

/// One frame as recorded (a line of frames.csv).
struct FrameRecord {
  std::string camera;
  int index = 0;               ///< position in its camera's sequence, from 0
  std::uint64_t sequence = 0;  ///< the device's count
  Stamp stamp{};               ///< middle of the exposure
  Duration stamp_sigma{};      ///< one standard deviation of `stamp`; 0 if not known
  Duration exposure{};
  Phase phase = Phase::kMove;
  int pass = 0;                  ///< sweep pass, from 0
  bool laser_on = false;         ///< emitting during the whole exposure
  std::optional<JointVector> q;  ///< joints interpolated at `stamp`; none if imported or refused
  Duration sync_residual{};      ///< distance in time to the nearer joint sample used
  double sync_on_target = 0;     ///< how far the laser plane moves at the object in that time [m]
  std::optional<Plane> cPl;      ///< laser plane in the camera frame, where it is given per frame (imported sessions)
  std::string file;              ///< relative to the session, e.g. frames/mono/000012.png
};

enum class CameraRole : std::uint8_t { kMono, kLeft, kRight };
template <>
inline constexpr std::array kNames<CameraRole>{"mono", "left", "right"};
const char* to_string(CameraRole role);

}  // namespace tankrig
