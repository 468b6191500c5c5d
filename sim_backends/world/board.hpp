// A calibration board in the simulated tank: it lies there, moves with the end effector, or is shown to the cameras.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/time.hpp"
#include "sim_backends/world/board_print.hpp"

namespace tankrig::sim {

/// An operator who shows a board to one camera, in many places and turned in many ways.
struct BoardShow {
  std::string camera;
  int count = 24;                      ///< places
  double nearest = 0.5, farthest = 1;  ///< distance from the camera [m]; nearer where something is in the way
  double tilt = 0.6;                   ///< largest angle between board and image plane [rad]
  std::uint64_t seed = 1;
};

struct BoardSpec {
  std::string name;
  BoardPattern pattern;
  enum class Place { kTank, kEndEffector, kShown } place = Place::kTank;
  Transform pose = Transform::Identity();   ///< of the board in w or e; of no meaning for a board that is shown
  std::vector<BoardShow> shows;             ///< one after another, then again from the first
  Duration hold = std::chrono::seconds{1};  ///< how long a board is held still in one place
};

struct CameraSpec;
class RenderGeometry;

/// Where the board is shown, wMt. The board's middle goes over the camera's image by a fixed sequence, so that few places
/// cover it well; `geometry` keeps it from being hidden.
std::vector<Transform> places_of(const BoardShow& show, const BoardPrint& print, const CameraSpec& camera,
                                 const RenderGeometry& geometry);

}  // namespace tankrig::sim
