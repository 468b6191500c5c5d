#include "core/mesh_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstring>

#include "core/input_error.hpp"
#include "core/regular_file.hpp"

namespace tankrig {

void check_mesh_file(const std::filesystem::path& file) {
  constexpr std::size_t kHeaderBytes =
      20;  // magic, version, length of the whole; then length and kind of the first part
  const int descriptor = open_regular_file(file, kMostMeshBytes, "a triangle mesh file");
  std::array<unsigned char, kHeaderBytes> head{};
  struct stat status {};
  const ssize_t got = ::pread(descriptor, head.data(), head.size(), 0);
  const bool known = ::fstat(descriptor, &status) == 0;
  ::close(descriptor);
  if (got < 0 || !known) throw InputError(file, "cannot be read, expected a triangle mesh file");
  const bool has_magic = std::memcmp(head.data(), "glTF", 4) == 0;
  if (!has_magic && file.extension() != ".glb" && file.extension() != ".GLB") return;
  const auto number = [&](std::size_t at) {
    return head[at] | head[at + 1] << 8 | head[at + 2] << 16 | static_cast<std::uint64_t>(head[at + 3]) << 24;
  };
  const auto bytes = static_cast<std::uint64_t>(status.st_size);
  const std::uint64_t whole = number(8), first_part = number(12);
  if (has_magic && whole >= kHeaderBytes && whole <= bytes && first_part <= bytes - kHeaderBytes) return;
  throw InputError(file, has_magic ? "found a header of " + std::to_string(whole) + " bytes, the first part " +
                                         std::to_string(first_part) + ", in a file of " + std::to_string(bytes) +
                                         ", expected a binary glTF that is whole"
                                   : "found no glTF at its beginning, expected a binary glTF");
}

}  // namespace tankrig
