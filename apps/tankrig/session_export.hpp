// `tankrig session export`: a session for other programs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/tankrig/command_line.hpp"
#include "apps/tankrig/open_session.hpp"
#include "core/camera_file.hpp"
#include "session/reading/session.hpp"

namespace tankrig::app {

struct SessionExportOptions {
  std::filesystem::path session;
  std::vector<std::string> formats;  ///< candump, camera_info, csv, bag
  bool all = false;
  std::filesystem::path out;  ///< folder; empty: SESSION-export
  bool raw_images = false;    ///< in the bag: sensor_msgs/Image instead of the PNG files
  bool json = false;
};

void add_session_export(CLI::App& session, ChosenCommand& chosen);
int export_session(const SessionExportOptions& options);

/// The rectification of every camera by its name: the pair's own, where it is one, as the stereo methods use it.
std::map<std::string, Rectification> rectifications(const Session& session);

/// The whole session as a ROS 1 bag; topics and frames: docs/reference/export.md.
/// Errors: InputError, also of a program built without librosbag-storage.
void write_session_bag(const OpenedSession& opened, bool raw_images, const std::filesystem::path& file);

}  // namespace tankrig::app
