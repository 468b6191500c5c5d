#include "core/shown_text.hpp"

namespace tankrig {
namespace {

/// Bytes of the printable UTF-8 character at the front of `text`; 0 if there is none.
std::size_t printable_bytes(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
  const std::size_t bytes = first >= 0xc2 && first < 0xe0   ? 2
                            : first >= 0xe0 && first < 0xf0 ? 3
                            : first >= 0xf0 && first < 0xf5 ? 4
                                                            : 0;
  if (bytes == 0 || text.size() < bytes) return 0;
  for (std::size_t i = 1; i < bytes; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  const bool control = first == 0xc2 && byte(1) < 0xa0;
  const bool overlong = (first == 0xe0 && byte(1) < 0xa0) || (first == 0xf0 && byte(1) < 0x90);
  const bool no_character = (first == 0xed && byte(1) >= 0xa0) || (first == 0xf4 && byte(1) >= 0x90);
  return control || overlong || no_character ? 0 : bytes;
}

}  // namespace

std::string shown_text(std::string_view value, std::size_t longest) {
  std::string out;
  for (std::size_t characters = 0; !value.empty(); ++characters) {
    if (characters == longest) return out + "...";
    const std::size_t bytes = printable_bytes(value);
    out += bytes ? value.substr(0, bytes) : "?";
    value.remove_prefix(bytes ? bytes : 1);
  }
  return out;
}

std::string without(std::string text, std::string_view hidden) {
  for (std::size_t at; (at = text.find(hidden)) != std::string::npos;) text.erase(at, hidden.size());
  return text;
}

std::size_t find_unprintable(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const bool space = text[i] == '\t' || text[i] == '\n' || text[i] == '\r';
    const std::size_t bytes = space ? 1 : printable_bytes(text.substr(i));
    if (bytes == 0) return i;
    i += bytes;
  }
  return std::string_view::npos;
}

}  // namespace tankrig
