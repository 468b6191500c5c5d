// `tankrig camera preview`: what a camera sees now, for focusing, exposing and aiming.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/tankrig/command_line.hpp"

namespace tankrig::app {

struct CameraPreviewOptions {
  std::string rig = "tank-sim";               ///< name below etc/rigs, or a path to a rig.yaml
  std::string camera;                         ///< empty: the rig file's first
  std::filesystem::path out = "preview.png";  ///< refreshed in place; the page that shows it lies beside it
  std::optional<double> seconds;              ///< nothing: until Ctrl-C, or what a virtual clock or the laser allows
  double rate_hz = 5;                         ///< refreshes per second, at most
  bool laser = false, yes = false, json = false;
};

/// Longest time that the laser stays on for one preview [s].
inline constexpr double kLongestLitPreview = 120;

/// Defines the command, its subcommand and their options.
void add_camera(CLI::App& app, ChosenCommand& chosen);

int camera_preview(const CameraPreviewOptions& options);

}  // namespace tankrig::app
