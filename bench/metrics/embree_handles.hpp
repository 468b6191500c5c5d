// Embree's device and scene as values that release themselves.
#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <stdexcept>
#include <type_traits>

#include "bench/metrics/triangle_mesh.hpp"

namespace tankrig {

struct EmbreeRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using EmbreeDevice = std::unique_ptr<std::remove_pointer_t<RTCDevice>, EmbreeRelease>;
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, EmbreeRelease>;

inline EmbreeDevice make_embree_device(const char* config) {
  EmbreeDevice device(rtcNewDevice(config));
  if (!device) throw std::runtime_error("embree: no device for \"" + std::string(config) + "\"");
  return device;
}

/// Adds `mesh`, rounded to single precision, to `scene`.
inline RTCGeometry attach_mesh(RTCDevice device, RTCScene scene, const TriangleMesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.vertices.size()));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), mesh.triangles.size()));
  for (const Vector3d& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) *vertices++ = static_cast<float>(v[k]);
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) *indices++ = static_cast<unsigned>(t[k]);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  return geometry;
}

}  // namespace tankrig
