// What assimp may open: a mesh names other files, and they are no more to be trusted than itself.
#pragma once

#include <assimp/DefaultIOSystem.h>

#include "core/input_error.hpp"
#include "core/mesh_file.hpp"

namespace tankrig {

/// Files that check_mesh_file() refuses are not there.
class AssimpFiles final : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* file) const override {
    try {
      check_mesh_file(file);
      return true;
    } catch (const InputError&) {
      return false;
    }
  }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return Exists(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }
};

}  // namespace tankrig
