// Clouds on disk: PLY and PCD, ours and other programs'.
#pragma once

#include <filesystem>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

enum class CloudEncoding { kBinary, kAscii };

/// Reads a .ply (ascii, binary of either byte order) or .pcd file (ascii, binary, binary_compressed) by its extension.
/// Takes x y z, and intensity, frame, column, sigma and normals (nx ny nz, normal_x normal_y normal_z) where they are;
/// every other property, list and element is skipped. Normals are made unit.
/// Points with a coordinate that is not finite are left out and counted. An integer intensity is divided by its type's
/// maximum. The cloud's frame comes from the comment line `frame LETTER`; without one it is empty: not known.
/// Errors: InputError with file, line or field, what was found and what was expected.
PointCloud read_cloud(const std::filesystem::path& file);

/// Writes .ply or .pcd by extension: float32 x y z [m], intensity [0, 1], int32 frame, float32 column [px], sigma [m],
/// and float32 normals if every point has one.
/// read_cloud gives all of it back (coordinates rounded to float32). The file appears whole or not at all.
/// Errors: InputError if the extension is unknown or the file cannot be written.
void write_cloud(const std::filesystem::path& file, const PointCloud& cloud,
                 CloudEncoding encoding = CloudEncoding::kBinary);

}  // namespace tankrig
