// A user's value as a message shows it: short, printable, on one line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tankrig {

/// At most `longest` characters, then "..."; '?' for every control character and every byte that is not UTF-8.
std::string shown_text(std::string_view value, std::size_t longest = 60);

/// A text in which `hidden` does not stand any more, a folder's path for instance.
std::string without(std::string text, std::string_view hidden);

/// Where the first control character (tabs and line ends apart) or byte that is not UTF-8 stands; npos: nowhere.
std::size_t find_unprintable(std::string_view text);

/// A whole text from others, safe to show on a terminal.
inline std::string printable(std::string_view text) { return shown_text(text, std::string_view::npos); }

}  // namespace tankrig
