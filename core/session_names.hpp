// Names that a session, its tables or its spool give: of nothing outside the session, whoever wrote them.
#pragma once

#include <string_view>

namespace tankrig {

/// Whether `name` can be a file's or a folder's inside a session: no path, no control character.
bool is_file_name(std::string_view name);

/// Whether it can be a camera's: also the field of a CSV table and a ROS topic.
bool is_camera_name(std::string_view name);

/// Whether `file` is a picture's of `camera`: frames/CAMERA/..., without "." and "..".
bool is_picture_name(std::string_view file, std::string_view camera);

}  // namespace tankrig
