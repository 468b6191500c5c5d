// Bytes as a page holds them.
#pragma once

#include <string>
#include <string_view>

namespace tankrig {

std::string base64(std::string_view bytes);

}  // namespace tankrig
