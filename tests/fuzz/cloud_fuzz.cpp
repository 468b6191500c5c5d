// Point clouds, ours and other programs': a file behind a byte, y for PLY, else PCD.
#include "core/input_error.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  static const fuzzing::ScratchFolder folder;
  const bool ply = bytes[0] == 'y';
  const auto file = folder.put(ply ? "cloud.ply" : "cloud.pcd", bytes + 1, size - 1);
  return fuzzing::refused_or_parsed<InputError>([&] {
    const PointCloud cloud = read_cloud(file);
    for (const CloudPoint& point : cloud.points)
      if (!point.p.allFinite()) std::abort();
    const auto again = folder.path() / (ply ? "again.ply" : "again.pcd");
    write_cloud(again, cloud);
    if (read_cloud(again).points.size() + read_cloud(again).invalid != cloud.points.size()) std::abort();
  });
}
