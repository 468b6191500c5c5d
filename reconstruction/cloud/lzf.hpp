// LZF, the compression inside PCD's binary_compressed data.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tankrig::cloud_file {

/// The `size` bytes that `packed` stands for; nothing if `packed` is damaged or gives another size.
/// Format: a control byte below 32 copies that many bytes plus one; otherwise its top three bits (7: plus the next
/// byte) plus two are the length of a repetition, and the rest with the next byte is how far back it begins, minus one.
std::optional<std::string> lzf_unpack(std::string_view packed, std::size_t size);

}  // namespace tankrig::cloud_file
