// A file whose content a fuzzer sets again and again: parsers here take paths.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace tankrig::fuzzing {

/// A folder of this process in memory, removed at its end.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = "/dev/shm/tankrig-fuzz-XXXXXX";
    if (!::mkdtemp(name.data())) throw std::runtime_error("cannot create " + name);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  /// `name` in it, with these bytes and no others.
  std::filesystem::path put(const std::string& name, const std::uint8_t* bytes, std::size_t size) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream(file, std::ios::binary | std::ios::trunc)
        .write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(size));
    return file;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// For parsers whose only way to refuse is an InputError: anything else that leaves `parse` ends the process.
template <class Refusal, class Parse>
int refused_or_parsed(Parse parse) {
  try {
    parse();
  } catch (const Refusal& e) {
    if (std::string(e.what()).empty()) std::abort();
  }
  return 0;
}

}  // namespace tankrig::fuzzing
