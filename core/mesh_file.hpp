// Mesh files before assimp reads them: regular, of a bounded size, and of the lengths they state.
#pragma once

#include <filesystem>

namespace tankrig {

/// assimp makes room for what a binary glTF says its first part holds, before it looks whether that is there.
/// Errors: InputError if `file` cannot be read, is no regular file, is too large, or is a .glb (by its name or its
/// first bytes) whose header is not true.
void check_mesh_file(const std::filesystem::path& file);

}  // namespace tankrig
