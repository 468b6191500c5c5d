// The account of a camera's frames: each expected frame is recorded, or left out for a named reason.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace tankrig {

using FrameCounts = std::map<std::string, std::uint64_t>;  ///< "CAMERA.REASON", "CAMERA.recorded", and others

struct CameraAccount {
  std::uint64_t expected = 0;    ///< frames that were exposed, or were to be
  std::int64_t unaccounted = 0;  ///< of these, neither recorded nor left out for a reason; below 0: counted twice
  bool closes() const { return unaccounted == 0; }
};

/// Why frames of a camera were left out, and how many; without zeros.
std::vector<std::pair<std::string, std::uint64_t>> frame_reasons(const FrameCounts& counts, const std::string& camera);

std::int64_t unaccounted(const FrameCounts& counts, const std::string& camera, std::uint64_t expected);

/// Frames exposed while the camera was not recording are not lost.
bool lost_nothing(const FrameCounts& counts, const std::string& camera, const CameraAccount& account);

/// "165 of 171 frames recorded: incomplete 2, lost 4".
std::string account_line(const FrameCounts& counts, const std::string& camera, const CameraAccount& account);

}  // namespace tankrig
