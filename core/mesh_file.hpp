// Mesh files before assimp reads them: regular, of a bounded size, and with room for what their headers state.
#pragma once

#include <filesystem>

namespace tankrig {

/// assimp makes room for what a binary glTF, a PLY or an OFF says it holds, before it looks whether that is there.
/// Errors: InputError if `file` cannot be read, is no regular file, is too large, or is one of these (by its name or
/// its first bytes) and states more than it has bytes.
void check_mesh_file(const std::filesystem::path& file);

}  // namespace tankrig
