// The cloud coloured by what each point was taken for, with its error, to look at over the object.
#pragma once

#include <array>
#include <filesystem>

#include "bench/metrics/metrics.hpp"

namespace tankrig {

/// Red, green, blue: ground black, object green, outlier blue; rejected grey.
std::array<std::uint8_t, 3> verdict_colour(PointVerdict verdict);

/// Binary PLY: x y z float [m] in the cloud's frame, error float: the distance to the surface [m], sigma float as in the
/// cloud, red green blue uchar. Points that are not finite are left out. The file appears complete or not at all.
/// `metrics`: of this cloud.
/// Errors: InputError if it cannot be written, or counts differ.
void write_verdict_cloud(const std::filesystem::path& file, const PointCloud& cloud, const Metrics& metrics);

}  // namespace tankrig
