// The arm in a camera's view, hiding what is behind it. Costs nothing while it is out of view.
#pragma once

#include "sim_backends/world/arm_body.hpp"
#include "sim_backends/world/board_layer.hpp"
#include "sim_backends/world/camera_view.hpp"

namespace tankrig::sim {

class ArmLayer {
 public:
  ArmLayer(const std::vector<Capsule>& bodies, const CameraView& view);

  bool in_view() const { return !bodies_.empty(); }

  /// Covers rows [first, first + count) of the image, `rows` starting at row `first`, but for what `boards` hide.
  void cover(int first, int count, float* rows, const Radiometry& radiometry, float light,
             const BoardLayer& boards) const;

 private:
  struct Window {
    float left, top, right, bottom;  ///< undistorted coordinates
  };
  const CameraView* view_;
  std::vector<Capsule> bodies_;  ///< those in view
  std::vector<Window> windows_;
};

}  // namespace tankrig::sim
