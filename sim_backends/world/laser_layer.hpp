// The laser's light in one frame: the stripe on the surfaces, and the glow of the sheet in the water.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim_backends/world/camera_view.hpp"
#include "sim_backends/world/laser_sheet.hpp"

namespace tankrig::sim {

/// The sheet while one frame is exposed: where it was, how strong, what stands in it.
struct ExposedSheet {
  static constexpr int kSamples = 3;
  std::array<SheetPose, kSamples> pose{};
  std::array<float, kSamples> power{};  ///< share of the projector's power, divided by kSamples
  std::vector<Capsule> blockers;

  float total_power() const { return power[0] + power[1] + power[2]; }
};

/// Digital numbers of the laser's light before its colour, in tiles of the image.
/// Work is proportional to the stripe's length: cells of the image that the sheet misses are skipped.
class LaserLayer {
 public:
  static constexpr int kTile = 16;  ///< pixels along a tile's side

  LaserLayer(const CameraView& view, const LaserSheet& sheet, const ExposedSheet& exposed,
             const RenderGeometry& geometry, float water_scattering);

  /// Adds the stripe, blurred by the optics and speckled, to rows [tile_row * kTile, ...) of `rows` (image layout).
  void add_stripe(int tile_row, float* rows, const std::array<float, 3>& colour, float speckle_contrast,
                  std::uint64_t speckle_key) const;
  /// Adds the glow of the sheet to the same rows.
  void add_glow(int tile_row, float* rows, const std::array<float, 3>& colour) const;

 private:
  static constexpr int kTileSub = kTile * CameraView::kSub;
  struct Tile {
    int lit_left = kTileSub, lit_top = kTileSub, lit_right = -1, lit_bottom = -1;  ///< sub-pixels with light
    std::array<float, kTileSub * kTileSub> light{};
  };
  void find_tiles(const ExposedSheet& exposed, const LaserSheet& sheet);
  void light_tile(int tile_x, int tile_y, Tile& tile, const LaserSheet& sheet, const ExposedSheet& exposed,
                  const RenderGeometry& geometry) const;
  void make_glow(const LaserSheet& sheet, const ExposedSheet& exposed, const RenderGeometry& geometry,
                 float scattering);
  bool cell_touched(int cell_x, int cell_y, const ExposedSheet& exposed, const LaserSheet& sheet) const;

  const CameraView* view_;
  int tiles_x_, tiles_y_;
  std::vector<int> tile_index_;  ///< into tiles_, -1 where the sheet meets nothing
  std::vector<std::pair<int, int>> tile_at_;
  std::vector<Tile> tiles_;
  std::vector<float> glow_;  ///< at the corners of the tiles; empty where negligible
};

}  // namespace tankrig::sim
