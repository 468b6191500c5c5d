#include "bench/metrics/line_of_sight.hpp"

#include "bench/metrics/embree_handles.hpp"

namespace tankrig {

struct LineOfSight::Impl {
  EmbreeDevice device = make_embree_device("isa=sse4.2");
  EmbreeScene scene{rtcNewScene(device.get())};
};

LineOfSight::LineOfSight(const std::vector<const TriangleMesh*>& meshes) : impl_(std::make_unique<Impl>()) {
  rtcSetSceneFlags(impl_->scene.get(), RTC_SCENE_FLAG_ROBUST);
  for (const TriangleMesh* mesh : meshes) attach_mesh(impl_->device.get(), impl_->scene.get(), *mesh);
  rtcCommitScene(impl_->scene.get());
}

LineOfSight::~LineOfSight() = default;
LineOfSight::LineOfSight(LineOfSight&&) noexcept = default;
LineOfSight& LineOfSight::operator=(LineOfSight&&) noexcept = default;

bool LineOfSight::clear(const Vector3d& from, const Vector3d& to) const {
  const Vector3d along = to - from;
  RTCRay ray{};
  ray.org_x = static_cast<float>(from.x());
  ray.org_y = static_cast<float>(from.y());
  ray.org_z = static_cast<float>(from.z());
  ray.dir_x = static_cast<float>(along.x());
  ray.dir_y = static_cast<float>(along.y());
  ray.dir_z = static_cast<float>(along.z());
  ray.tnear = 0;
  ray.tfar = 1;
  ray.mask = ~0u;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->scene.get(), &context, &ray);
  return ray.tfar >= 0;
}

}  // namespace tankrig
