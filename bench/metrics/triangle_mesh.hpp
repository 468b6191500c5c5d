// The object's surface as triangles, and how it is read from a file.
#pragma once

#include <filesystem>
#include <vector>

#include "core/frames.hpp"

namespace tankrig {

/// Frames: o, the mesh file's own.
/// Units: metres. Corners run counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;

  double area() const;
  Eigen::AlignedBox3d bounds() const;
  /// Positive for a closed mesh whose normals point outwards; meaningless for an open one [m3].
  double signed_volume() const;
};

double triangle_area(const TriangleMesh& mesh, std::size_t triangle);

/// The same mesh with vertices at exactly equal positions made one.
TriangleMesh weld(const TriangleMesh& mesh);

/// How the triangles of a welded mesh hang together.
struct MeshTopology {
  bool closed = false;   ///< every edge has exactly two triangles, which run along it in opposite directions
  bool outward = false;  ///< closed, and its normals point outwards
};

MeshTopology topology(const TriangleMesh& welded);

/// Any format assimp reads. Faces with more corners are cut into triangles, the scene's node transforms are applied,
/// equal vertices are welded, a closed mesh with inward normals is turned over. A Collada file's up axis is left as it
/// is. With a `root`, nothing outside of that folder is read: a mesh may name other files.
/// Errors: InputError if the file is missing, unreadable, has a coordinate that is not finite, no face, or a size that
/// is not one of metres.
TriangleMesh read_mesh(const std::filesystem::path& file, const std::filesystem::path& root = {});

}  // namespace tankrig
