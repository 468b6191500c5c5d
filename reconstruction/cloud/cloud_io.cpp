#include "reconstruction/cloud/cloud_io.hpp"

#include <algorithm>
#include <fstream>

#include "core/input_error.hpp"
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

void write_atomically(const fs::path& file, const std::string& text) {
  fs::path partial = file;
  partial += ".partial";
  std::ofstream out(partial, std::ios::binary | std::ios::trunc);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  std::error_code error;
  if (out) fs::rename(partial, file, error);
  if (!out || error) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw InputError(
        file, "cannot be written (" + std::to_string(text.size()) + " bytes), expected a writable folder with room");
  }
}

}  // namespace

PointCloud read_cloud(const fs::path& file) {
  const std::string extension = lower_extension(file);
  const std::string text = read_regular_file(file, kMostCloudBytes, "a point cloud");
  return extension == ".ply" ? cloud_file::read_ply(file, text) : cloud_file::read_pcd(file, text);
}

void write_cloud(const fs::path& file, const PointCloud& cloud, CloudEncoding encoding) {
  const bool ascii = encoding == CloudEncoding::kAscii;
  write_atomically(
      file, lower_extension(file) == ".ply" ? cloud_file::ply_text(cloud, ascii) : cloud_file::pcd_text(cloud, ascii));
}

}  // namespace tankrig
