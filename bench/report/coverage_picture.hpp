// Where the cloud covers the object, on its surface unfolded.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "bench/metrics/metrics.hpp"

namespace tankrig {

/// 1 for every sample with a point of the object nearer than `threshold` [m] or as near.
/// Frames: o.
std::vector<std::uint8_t> covered_samples(const std::vector<SurfaceSample>& samples, const PointCloud& cloud,
                                          const std::vector<PointVerdict>& verdicts, double threshold);

/// The surface in six panels, one per direction (+x -x +y -y +z -z of o) that its triangles mostly face, laid out as a
/// box is unfolded around its top: green covered, orange seen but not covered, grey not seeable. The legend gives
/// shares of the whole surface. One entry per sample; an empty `reachable` stands for no known ceiling.
/// Errors: InputError if the counts differ.
cv::Mat draw_coverage_map(const TriangleMesh& mesh, const std::vector<SurfaceSample>& samples,
                          const std::vector<std::uint8_t>& covered, const std::vector<std::uint8_t>& reachable,
                          const std::string& title = "");

}  // namespace tankrig
