// A cloud's mesh as STL, OBJ and PLY.
#include <array>
#include <cstdio>

#include "core/atomic_file.hpp"
#include "reconstruction/pointcloud/cloud_mesh.hpp"

namespace tankrig {
namespace {

template <class T>
void append_bytes(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_vertex(std::string& out, const Eigen::Vector3f& v) {
  out.append(reinterpret_cast<const char*>(v.data()), 12);
}

std::string stl_text(const CloudMesh& mesh) {
  std::string out = "tankrig mesh, frame " + mesh.frame + ", metres";  // must not begin with "solid"
  out.resize(80, ' ');
  append_bytes(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    append_vertex(out, (b - a).cross(c - a).normalized());
    for (const Eigen::Vector3f& corner : {a, b, c}) append_vertex(out, corner);
    append_bytes(out, std::uint16_t{0});
  }
  return out;
}

std::string obj_text(const CloudMesh& mesh) {
  std::string out = "# tankrig mesh\n# frame " + mesh.frame + "\n# metres\n";
  char line[96];
  for (const Eigen::Vector3f& v : mesh.vertices)
    out.append(line,
               static_cast<std::size_t>(std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", v.x(), v.y(), v.z())));
  for (const auto& t : mesh.triangles)
    out.append(
        line, static_cast<std::size_t>(std::snprintf(line, sizeof line, "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1)));
  return out;
}

std::string mesh_ply_text(const CloudMesh& mesh) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment tankrig mesh: metres\ncomment frame " + mesh.frame +
                    "\nelement vertex " + std::to_string(mesh.vertices.size()) +
                    "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                    std::to_string(mesh.triangles.size()) + "\nproperty list uchar uint vertex_indices\nend_header\n";
  for (const Eigen::Vector3f& v : mesh.vertices) append_vertex(out, v);
  for (const auto& t : mesh.triangles) {
    append_bytes(out, std::uint8_t{3});
    append_bytes(out, t);
  }
  return out;
}

}  // namespace

void write_mesh(const std::filesystem::path& file, const CloudMesh& mesh) {
  if (mesh.triangles.empty()) throw InputError(file, "found no triangle to write, expected a surface");
  const std::string extension = file.extension().string();
  if (extension == ".stl") return write_file_durably(file, stl_text(mesh));
  if (extension == ".obj") return write_file_durably(file, obj_text(mesh));
  if (extension == ".ply") return write_file_durably(file, mesh_ply_text(mesh));
  throw InputError(file, "found extension '" + extension + "', expected .stl, .obj or .ply");
}

}  // namespace tankrig
