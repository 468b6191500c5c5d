// A user's value as a message may show it: short, printable, on one line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tankrig {

/// At most `longest` characters, then "..."; '?' for every control character and every byte that is not UTF-8.
std::string shown_text(std::string_view value, std::size_t longest = 60);

/// All of a text that may hold what others wrote, as a terminal may show it.
inline std::string printable(std::string_view text) { return shown_text(text, std::string_view::npos); }

}  // namespace tankrig
