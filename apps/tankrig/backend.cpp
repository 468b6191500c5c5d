#include "apps/tankrig/backend.hpp"

namespace tankrig::app {

std::vector<std::string> camera_names(const RigConfig& rig) {
  std::vector<std::string> out;
  for (const RigCamera& camera : rig.cameras) out.push_back(camera.name);
  return out;
}

std::unique_ptr<Backend> make_backend(const RigConfig& rig, const BackendOptions& options) {
  return rig.backend == "mock" ? make_mock_backend(rig, options) : make_device_backend(rig, options);
}

}  // namespace tankrig::app
