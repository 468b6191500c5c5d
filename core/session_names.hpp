// Names found in a session, its tables or its spool may not lead out of the session, whoever wrote them.
#pragma once

#include <string_view>

namespace tankrig {

/// Whether `name` can name a file or folder inside a session: no path, no control character.
bool is_file_name(std::string_view name);

/// Whether `name` can name a camera: it is also a field of a CSV table and a ROS topic.
bool is_camera_name(std::string_view name);

/// Whether `file` can be a picture of `camera`: frames/CAMERA/..., without "." and "..".
bool is_picture_name(std::string_view file, std::string_view camera);

}  // namespace tankrig
