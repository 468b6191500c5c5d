// A folder of its own for temporary files, removed with all that is in it.
#pragma once

#include <filesystem>
#include <string>

namespace tankrig::app {

class ScratchFolder {
 public:
  /// `name`: how it begins.
  /// Errors: CannotWrite.
  explicit ScratchFolder(const std::string& name);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

  /// What the destructor does, with its outcome: false if something is left.
  bool remove();

 private:
  std::filesystem::path path_;
};

}  // namespace tankrig::app
