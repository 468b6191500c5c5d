// What was true of an emulated camera's exposures, as `tankrig emulate --truth` writes it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/time.hpp"

namespace tankrig::test {

struct TrueExposure {
  std::uint64_t index;
  Stamp mid;
  double elbow, laser;
};

/// Those of a CAMERA.csv that is whole, or still being written: without a line that is not.
std::vector<TrueExposure> read_true_exposures(const std::filesystem::path& file);

}  // namespace tankrig::test
