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

void write_verdict_cloud(const std::filesystem::path& file, const PointCloud& cloud,
                         const std::vector<PointVerdict>& verdicts) {
  if (verdicts.size() != cloud.points.size())
    throw InputError(
        file, fmt::format("{} verdicts, expected one for each of {} points", verdicts.size(), cloud.points.size()));
  std::string body;
  std::size_t count = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].p.allFinite()) continue;
    const Eigen::Vector3f p = cloud.points[i].p.cast<float>();
    const auto colour = verdict_colour(verdicts[i]);
    char record[15];
    std::memcpy(record, p.data(), 12);
    std::memcpy(record + 12, colour.data(), 3);
    body.append(record, sizeof record);
    ++count;
  }

  const std::string header = fmt::format(
      "ply\n"
      "format binary_little_endian 1.0\n"
      "comment frame {}, metres; ground black, object green, outlier blue, rejected grey\n"
      "element vertex {}\n"
      "property float x\n"
      "property float y\n"
      "property float z\n"
      "property uchar red\n"
      "property uchar green\n"
      "property uchar blue\n"
      "end_header\n",
      cloud.frame, count);
  write_file_durably(file, header + body);
}

}  // namespace tankrig
