// Files below a folder of sessions or of results, as a browser may have them.
#pragma once

#include <filesystem>
#include <string>

#include "console/server/web_messages.hpp"

namespace tankrig {

/// `path`: NAME/FILE. Only regular files without a link on the way; what a browser would run as a page is shown without
/// the console's rights. 404 says why there is nothing.
WebReply session_file(const std::filesystem::path& sessions, const std::string& path);

/// A file's name without what could end a header's quotes or name another place.
std::string plain_name(const std::filesystem::path& file);

}  // namespace tankrig
