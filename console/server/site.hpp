// The page, compiled in.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tankrig {

struct SiteFile {
  const char* type;
  std::string_view text;
};

/// `path`: "/", "/console.js", "/console.css", "/login"; "/platform", "/platform.js". A program built without npm has a page that says
/// so.
std::optional<SiteFile> site_file(const std::string& path);

}  // namespace tankrig
