// Boards that move, in a camera's view: hiding what is behind them. Costs nothing while none is in view.
#pragma once

#include <memory>
#include <vector>

#include "sim_backends/world/board_print.hpp"
#include "sim_backends/world/camera_view.hpp"

namespace tankrig::sim {

struct PlacedBoard {
  std::shared_ptr<const BoardPrint> print;
  Transform wMt = Transform::Identity();
};

/// Lit by lamps, with the shadows of tank and objects, and by diffuse light; not by the laser. Boards throw no shadow.
/// Construction is the costly part; boards that stand still need it once.
class BoardLayer {
 public:
  BoardLayer(const std::vector<PlacedBoard>& boards, const CameraView& view, const Radiometry& radiometry);

  bool in_view() const { return !boards_.empty(); }
  /// Distance along the line of sight to the nearest board [m]; large where there is none.
  float range(const CameraView::Sight& ray) const;

  /// Covers rows [first, first + count) of the image, `rows` starting at row `first`.
  void cover(int first, int count, float* rows, float light) const;

 private:
  static constexpr int kNodes = 9;  ///< of the light on a board, along each side
  struct Board {
    std::shared_ptr<const BoardPrint> print;
    Eigen::Isometry3f tMw;
    bool front;                    ///< the camera sees what is printed
    int left, right, top, bottom;  ///< pixels of the image that it may touch; right and bottom excluded
    struct Node {
      Eigen::Array4f light, veil;  ///< on the board, after the water to the camera; the water's own; fourth: 0
    };
    std::array<Node, kNodes * kNodes> nodes;
    std::vector<Eigen::Array4f>
        pixels;  ///< of [left, right) x [top, bottom): radiance at light 1, and the share it covers

    /// Of a line of sight in the board's frame.
    float range(const CameraView::Sight& ray_t) const;
    CameraView::Sight on_board(const CameraView::Sight& ray) const {
      return {tMw * ray.origin, tMw.linear() * ray.direction};
    }
    CameraView::FourSights on_board(const CameraView::FourSights& four) const;
    /// Light times `albedo`, and veil, at a place of the board from 0 to 1.
    Eigen::Array4f radiance(float albedo, float x, float y) const;
  };
  /// Light of a board in the fine samples [left, right) of row y, then in pixels.
  void sample_row(const Board& board, int y, const PixelFilter& filter, std::vector<Eigen::Array4f>& fine,
                  Eigen::Array4f* out) const;
  /// Pixels of rows [first, last).
  void sample(Board& board, int first, int last, const PixelFilter& filter) const;
  void cover(const Board& board, int first, int count, float* rows, float light) const;

  const CameraView* view_;
  std::vector<Board> boards_;
};

}  // namespace tankrig::sim
