#include "apps/tankrig/output.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/input_error.hpp"

namespace tankrig::app {

void print_json(const nlohmann::ordered_json& document) { std::printf("%s\n", document.dump(2).c_str()); }

void flush_output() {
  const bool failed_before = std::ferror(stdout) != 0;
  if (std::fflush(stdout) != 0 || failed_before)
    throw InputError(std::string("standard output cannot be written: ") + std::strerror(errno));
}

}  // namespace tankrig::app
