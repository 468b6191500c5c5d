// A triangle mesh made of a cloud, and its files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig {

/// Units: metres. Corners run counter-clockwise seen from outside, as far as the cloud's normals say where that is.
struct CloudMesh {
  std::string frame;  ///< letter of core/frames.hpp
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Poisson's surface (PCL's), smooth, with hardly a hole; with `trim_m` above 0, without what is farther than that from every
/// point, because there it is guessed. `depth` is the octree's: each level halves the cells.
/// Source: M. Kazhdan, M. Bolitho, H. Hoppe, Poisson surface reconstruction, 2006.
/// Errors: InputError if a point has no normal.
CloudMesh poisson_mesh(const PointCloud& cloud, int depth, double trim_m);

/// Neighbours no more than `edge_m` apart joined to triangles (PCL's greedy projection): the points themselves, holes
/// stay open.
/// Source: Z. C. Marton, R. B. Rusu, M. Beetz, On fast surface reconstruction methods for large and noisy datasets, 2009.
/// Errors: InputError if a point has no normal.
CloudMesh greedy_mesh(const PointCloud& cloud, double edge_m);

/// What the module of PCL's surfaces does, for clouds whose points all have normals.
struct SurfaceMethods {
  CloudMesh (*poisson)(const PointCloud& cloud, int depth, double trim_m);
  CloudMesh (*greedy)(const PointCloud& cloud, double edge_m);
};

/// .stl (binary), .obj or .ply (binary) by extension; a comment names frame and unit. The file appears whole or not at
/// all.
/// Errors: InputError for another extension, a mesh without a triangle, or a file that cannot be written.
void write_mesh(const std::filesystem::path& file, const CloudMesh& mesh);

}  // namespace tankrig
