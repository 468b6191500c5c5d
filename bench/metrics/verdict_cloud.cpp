#include "bench/metrics/verdict_cloud.hpp"

#include <fmt/core.h>

#include <bit>
#include <cstring>
#include <string>

#include "core/atomic_file.hpp"

namespace tankrig {

static_assert(std::endian::native == std::endian::little, "the PLY header below says little endian");

std::array<std::uint8_t, 3> verdict_colour(PointVerdict verdict) {
  switch (verdict) {
    case PointVerdict::kGround:
      return {0, 0, 0};
    case PointVerdict::kObject:
      return {0, 200, 0};
    case PointVerdict::kOutlier:
      return {0, 0, 255};
    case PointVerdict::kRejected:
      break;
  }
  return {128, 128, 128};
}

void write_verdict_cloud(const std::filesystem::path& file, const PointCloud& cloud, const Metrics& metrics) {
  if (metrics.verdicts.size() != cloud.points.size() || metrics.distances.size() != cloud.points.size())
    throw InputError(file, fmt::format("{} verdicts, expected one for each of {} points", metrics.verdicts.size(),
                                       cloud.points.size()));
  std::string body;
  std::size_t count = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].p.allFinite()) continue;
    const Eigen::Vector3f p = cloud.points[i].p.cast<float>();
    const float figures[] = {static_cast<float>(metrics.distances[i]), cloud.points[i].sigma};
    const auto colour = verdict_colour(metrics.verdicts[i]);
    char record[23];
    std::memcpy(record, p.data(), 12);
    std::memcpy(record + 12, figures, 8);
    std::memcpy(record + 20, colour.data(), 3);
    body.append(record, sizeof record);
    ++count;
  }

  const std::string header = fmt::format(
      "ply\n"
      "format binary_little_endian 1.0\n"
      "comment frame {}, metres; error is the distance to the surface; ground black, object green, outlier blue, "
      "rejected grey\n"
      "element vertex {}\n"
      "property float x\n"
      "property float y\n"
      "property float z\n"
      "property float error\n"
      "property float sigma\n"
      "property uchar red\n"
      "property uchar green\n"
      "property uchar blue\n"
      "end_header\n",
      cloud.frame, count);
  write_file_durably(file, header + body);
}

}  // namespace tankrig
