#include "reconstruction/cloud/cloud_io.hpp"

#include <algorithm>
#include <fstream>

#include "core/atomic_file.hpp"
#include "core/regular_file.hpp"
#include "reconstruction/cloud/scalar_fields.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".ply" && extension != ".pcd")
    throw InputError(file, "found extension '" + extension + "', expected .ply or .pcd");
  return extension;
}

}  // namespace

PointCloud read_cloud(const fs::path& file) {
  const std::string extension = lower_extension(file);
  const std::string text = read_regular_file(file, kMostCloudBytes, "a point cloud");
  return extension == ".ply" ? cloud_file::read_ply(file, text) : cloud_file::read_pcd(file, text);
}

void write_cloud(const fs::path& file, const PointCloud& cloud, CloudEncoding encoding) {
  const bool ascii = encoding == CloudEncoding::kAscii;
  write_file_durably(
      file, lower_extension(file) == ".ply" ? cloud_file::ply_text(cloud, ascii) : cloud_file::pcd_text(cloud, ascii));
}

}  // namespace tankrig
