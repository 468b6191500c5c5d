// What assimp may open: a mesh can name other files, and they are trusted no more than the mesh.
#pragma once

#include <assimp/DefaultIOSystem.h>

#include <filesystem>

#include "core/input_error.hpp"
#include "core/mesh_file.hpp"

namespace tankrig {

/// For assimp, files that check_mesh_file() refuses do not exist, nor files outside of `root` (if given).
class AssimpFiles final : public Assimp::DefaultIOSystem {
 public:
  explicit AssimpFiles(const std::filesystem::path& root = {})
      : root_(root.empty() ? root : std::filesystem::canonical(root) / "") {}
  bool Exists(const char* file) const override {
    try {
      const bool inside = root_.empty() || std::filesystem::weakly_canonical(file).string().starts_with(root_.string());
      check_mesh_file(file);
      return inside;
    } catch (const std::exception&) {
      return false;
    }
  }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return Exists(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  const std::filesystem::path root_;  ///< with a slash at its end
};

}  // namespace tankrig
