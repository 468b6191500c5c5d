// A small scan's session, made once for all tests of a program.
#pragma once

#include <filesystem>
#include <stdexcept>

#include "tests/program/program.hpp"

namespace tankrig::test {

inline const std::filesystem::path& scanned() {
  static const std::filesystem::path session = [] {
    const std::filesystem::path folder = scratch_folder().parent_path();
    const ProgramRun run =
        run_tankrig({"scan", "--rig", small_rig(folder / "rig").string(), "--out", (folder / "scanned").string()});
    if (run.exit_code != 0) throw std::runtime_error("scan failed: " + run.err);
    return folder / "scanned";
  }();
  return session;
}

/// A copy to be changed.
inline std::filesystem::path copied() {
  const std::filesystem::path copy = scratch_folder() / "copy";
  std::filesystem::copy(scanned(), copy, std::filesystem::copy_options::recursive);
  return copy;
}

}  // namespace tankrig::test
