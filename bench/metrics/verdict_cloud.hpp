// The cloud coloured by what each point was taken for, to look at over the object.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "bench/metrics/metrics.hpp"

namespace tankrig {

/// Red, green, blue: ground black, object green, outlier blue; rejected grey.
std::array<std::uint8_t, 3> verdict_colour(PointVerdict verdict);

/// Binary PLY: x y z float [m] in the cloud's frame, red green blue uchar. Points that are not finite are left out. The
/// file appears complete or not at all.
/// Errors: InputError if it cannot be written, or counts differ.
void write_verdict_cloud(const std::filesystem::path& file, const PointCloud& cloud,
                         const std::vector<PointVerdict>& verdicts);

}  // namespace tankrig
