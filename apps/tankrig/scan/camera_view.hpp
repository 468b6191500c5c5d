// How a camera does, as whoever listens to the feed sees it: its rate, exposure, focus and clipped pixels.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/tankrig/command_line/feed.hpp"

namespace tankrig::app {

struct CameraView {
  std::string name = {};
  std::optional<double> rate_hz = {}, exposure_ms = {};
  double focus = 0, best_focus = 0;  ///< focus_of() the newest frame, and the largest so far
  double clipped_share = 0;          ///< of its pixels, at full scale
  std::optional<std::uint64_t> lost = {};
};

/// Of all that have been seen.
inline void show_cameras(const std::vector<CameraView>& cameras) {
  if (!Feed::one().heard()) return;
  nlohmann::ordered_json said{{"feed", "cameras"}, {"cameras", nlohmann::ordered_json::array()}};
  for (const CameraView& camera : cameras) {
    nlohmann::ordered_json one{{"name", camera.name},
                               {"focus", camera.focus},
                               {"best_focus", camera.best_focus},
                               {"clipped_share", camera.clipped_share}};
    if (camera.rate_hz) one["rate_hz"] = *camera.rate_hz;
    if (camera.exposure_ms) one["exposure_ms"] = *camera.exposure_ms;
    if (camera.lost) one["lost"] = *camera.lost;
    said["cameras"].push_back(std::move(one));
  }
  Feed::one().tell_newest(said);
}

}  // namespace tankrig::app
