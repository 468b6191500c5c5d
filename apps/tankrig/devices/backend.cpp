#include "apps/tankrig/devices/backend.hpp"

#include "rig/executive/cycle.hpp"

namespace tankrig::app {

std::vector<std::string> camera_names(const RigConfig& rig) {
  std::vector<std::string> out;
  for (const RigCamera& camera : rig.cameras) out.push_back(camera.name);
  return out;
}

void EndBackend::operator()(Backend* backend) const noexcept {
  if (!Cycle::any_left_behind()) {
    delete backend;
    return;
  }
  backend->laser().last_resort();
  backend->arm().last_resort();
}

OwnBackend make_backend(const RigConfig& rig, const BackendOptions& options) {
  return OwnBackend(
      (rig.backend == "mock" ? make_mock_backend(rig, options) : make_device_backend(rig, options)).release());
}

}  // namespace tankrig::app
