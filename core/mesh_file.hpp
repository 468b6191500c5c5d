// Mesh files checked before assimp reads them: regular, of bounded size, and as long as their headers say.
#pragma once

#include <filesystem>

namespace tankrig {

/// assimp allocates what a binary glTF, a PLY or an OFF claims to hold before it looks whether the bytes are there.
/// Errors: InputError if `file` cannot be read, is no regular file, is too large, or is one of these (by name or first
/// bytes) and claims more than its size.
void check_mesh_file(const std::filesystem::path& file);

}  // namespace tankrig
