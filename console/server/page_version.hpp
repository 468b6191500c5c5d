// Which page this program has: a browser that still shows another one must load it anew.
#pragma once

#include <string>

namespace tankrig {

/// Of the page, its style and its program together: other bytes, another version.
std::string page_version();

/// The page, which carries it.
std::string page_with_version();

}  // namespace tankrig
