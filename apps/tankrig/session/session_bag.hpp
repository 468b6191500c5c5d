// A session as a ROS 1 bag, and its cameras as ROS names them.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "apps/tankrig/session/open_session.hpp"
#include "core/camera_file.hpp"
#include "session/reading/session.hpp"

namespace tankrig::app {

/// The rectification of every camera by its name: the pair's own, where it is one, as the stereo methods use it.
std::map<std::string, Rectification> rectifications(const Session& session);

/// The whole session as a ROS 1 bag; topics and frames: docs/reference/export.md.
/// Errors: InputError, also of a program built without librosbag-storage.
void write_session_bag(const OpenedSession& opened, bool raw_images, const std::filesystem::path& file);

}  // namespace tankrig::app
