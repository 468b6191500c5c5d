// Embree behind RenderGeometry. Its instruction set is fixed, so that frames do not depend on the machine's newest one.
#include "sim_backends/world/render_geometry.hpp"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <assimp/Importer.hpp>
#include <cstring>
#include <limits>
#include <string>

#include "core/assimp_files.hpp"
#include "core/input_error.hpp"
#include "sim_backends/world/surface_texture.hpp"

namespace tankrig::sim {
namespace {

struct Mesh {
  std::vector<Vector3f> vertices;
  std::vector<Eigen::Vector3i> triangles;
};

Mesh read_mesh(const std::filesystem::path& file) {
  check_mesh_file(file);
  Assimp::Importer importer;
  importer.SetIOHandler(new AssimpFiles);                                        // the importer's own from here on
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);  // axes as they are in the file
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_SortByPType);
  if (!scene) throw InputError(file, std::string("expected a triangle mesh: ") + importer.GetErrorString());
  Mesh mesh;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    const int first = static_cast<int>(mesh.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v)
      mesh.vertices.emplace_back(part.mVertices[v].x, part.mVertices[v].y, part.mVertices[v].z);
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      mesh.triangles.emplace_back(first + static_cast<int>(face.mIndices[0]),
                                  first + static_cast<int>(face.mIndices[1]),
                                  first + static_cast<int>(face.mIndices[2]));
    }
  }
  if (mesh.triangles.empty()) throw InputError(file, "found no triangle, expected a triangle mesh");
  return mesh;
}

Mesh quad(const Vector3f& corner, const Vector3f& side_a, const Vector3f& side_b) {
  return {{corner, corner + side_a, corner + side_a + side_b, corner + side_b}, {{0, 1, 2}, {0, 2, 3}}};
}

RTCRay make_ray(const Vector3f& origin, const Vector3f& direction, float from, float to) {
  RTCRay ray{};
  ray.org_x = origin.x(), ray.org_y = origin.y(), ray.org_z = origin.z();
  ray.dir_x = direction.x(), ray.dir_y = direction.y(), ray.dir_z = direction.z();
  ray.tnear = from, ray.tfar = to;
  ray.mask = ~0u;
  return ray;
}

}  // namespace

struct RenderGeometry::Embree {
  RTCDevice device = rtcNewDevice("isa=sse4.2");
  RTCScene scene = rtcNewScene(device);
  ~Embree() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

RenderGeometry::RenderGeometry(const Scene& scene) : embree_(std::make_unique<Embree>()) {
  rtcSetSceneFlags(embree_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(embree_->scene, RTC_BUILD_QUALITY_HIGH);
  const Vector3f size = scene.tank.size.cast<float>();
  const float x = size.x() / 2, y = size.y() / 2;
  const Vector3f along_x{size.x(), 0, 0}, along_y{0, size.y(), 0}, up{0, 0, size.z()};
  const auto add_tank = [&](const Mesh& mesh, Kind kind, const Material& material, const Vector3f& inward) {
    add(mesh.vertices, mesh.triangles, {kind, material, Eigen::Isometry3f::Identity(), inward, nullptr});
  };
  add_tank(quad({-x, -y, 0}, along_x, along_y), Kind::kFloor, scene.tank.floor, Vector3f::UnitZ());
  add_tank(quad({-x, -y, 0}, along_y, up), Kind::kWall, scene.tank.walls, Vector3f::UnitX());
  add_tank(quad({x, -y, 0}, along_y, up), Kind::kWall, scene.tank.walls, -Vector3f::UnitX());
  add_tank(quad({-x, -y, 0}, along_x, up), Kind::kWall, scene.tank.walls, Vector3f::UnitY());
  add_tank(quad({-x, y, 0}, along_x, up), Kind::kWall, scene.tank.walls, -Vector3f::UnitY());
  for (const SceneObject& object : scene.objects) {
    Mesh mesh = read_mesh(object.mesh);
    for (Vector3f& v : mesh.vertices) v = (object.wMo * v.cast<double>()).cast<float>();
    add(mesh.vertices, mesh.triangles,
        {Kind::kObject, object.material, object.wMo.inverse().cast<float>(), Vector3f::Zero(), nullptr});
  }
  for (const BoardSpec& board : scene.boards) {
    if (board.place != BoardSpec::Place::kTank) continue;
    auto print = std::make_shared<const BoardPrint>(board.pattern);
    const Vector2d from = print->from(), sides = print->size();
    Mesh mesh = quad({0, 0, 0}, {static_cast<float>(sides.x()), 0, 0}, {0, static_cast<float>(sides.y()), 0});
    for (Vector3f& v : mesh.vertices)
      v = (board.pose * (v.cast<double>() + Vector3d(from.x(), from.y(), 0))).cast<float>();
    add(mesh.vertices, mesh.triangles,
        {Kind::kObject, Material{}, board.pose.inverse().cast<float>(), Vector3f::Zero(), std::move(print)});
  }
  // One thread builds, so that the hierarchy is the same every time.
  tbb::task_arena(1).execute([&] { rtcCommitScene(embree_->scene); });
}

RenderGeometry::~RenderGeometry() = default;
RenderGeometry::RenderGeometry(RenderGeometry&&) noexcept = default;
RenderGeometry& RenderGeometry::operator=(RenderGeometry&&) noexcept = default;

void RenderGeometry::add(const std::vector<Vector3f>& vertices, const std::vector<Eigen::Vector3i>& triangles,
                         Surface surface) {
  RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  static_assert(sizeof(Vector3f) == 12 && sizeof(Eigen::Vector3i) == 12);
  std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, vertices.size()),
              vertices.data(), vertices.size() * 12);
  std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()),
              triangles.data(), triangles.size() * 12);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(embree_->scene, geometry, static_cast<unsigned>(surfaces_.size()));
  rtcReleaseGeometry(geometry);
  surfaces_.push_back(std::move(surface));
}

std::optional<SurfaceHit> RenderGeometry::intersect(const Vector3f& origin, const Vector3f& unit_direction,
                                                    float from) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = make_ray(origin, unit_direction, from, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  SurfaceHit hit;
  hit.distance = query.ray.tfar;
  hit.p = origin + hit.distance * unit_direction;
  hit.normal = Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalized();
  if (hit.normal.dot(unit_direction) > 0) hit.normal = -hit.normal;
  hit.surface = static_cast<int>(query.hit.geomID);
  return hit;
}

bool RenderGeometry::occluded(const Vector3f& origin, const Vector3f& unit_direction, float from, float to) const {
  if (!(from < to)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = make_ray(origin, unit_direction, from, to);
  rtcOccluded1(embree_->scene, &context, &ray);
  return ray.tfar < 0;
}

Rgb RenderGeometry::albedo(const SurfaceHit& hit) const {
  const Surface& s = surfaces_[hit.surface];
  if (s.print) {
    const Vector3f p = s.oMw * hit.p;
    const bool front = (s.oMw.linear() * hit.normal).z() < 0;
    return front ? Rgb(Rgb::Constant(s.print->albedo(p.x(), p.y()))) : s.material.albedo;
  }
  if (s.material.texture == Material::Texture::kPlain) return s.material.albedo;
  return texture_albedo(s.material, s.oMw * hit.p, s.oMw.linear() * hit.normal);
}

}  // namespace tankrig::sim
