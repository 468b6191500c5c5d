// Samples a board's print sixteen times a pixel and filters it as the optics do.
#include "sim_backends/world/board_layer.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace tankrig::sim {
namespace {

constexpr int kPerPixel = 4;  ///< samples along a pixel's side, those of CameraView::quarter_sights
constexpr float kNoBoard = 1e3f;
constexpr float kBackAlbedo = 0.3f;

}  // namespace

BoardLayer::BoardLayer(const std::vector<PlacedBoard>& boards, const CameraView& view, const Radiometry& radiometry)
    : view_(&view) {
  const CameraModel& model = view.spec().model;
  const Transform cMw = view.spec().wMc.inverse();
  const PixelFilter filter(view.spec().psf_sigma_px, kPerPixel);
  const int reach = 1 + filter.reach / kPerPixel;
  for (const PlacedBoard& placed : boards) {
    const BoardPrint& print = *placed.print;
    const auto at = [&](double x, double y) {
      const Vector2d p = print.from() + print.size().cwiseProduct(Vector2d(x, y));
      return Vector3d(p.x(), p.y(), 0);
    };
    Eigen::AlignedBox2d seen;
    bool behind = false;
    constexpr int kOutline = 16;
    for (int i = 0; i <= kOutline; ++i)
      for (int j = 0; j <= kOutline; ++j) {
        const Vector3d p = cMw * placed.wMt * at(i / double{kOutline}, j / double{kOutline});
        const auto pixel = model.project(p);
        if (p.z() < 0.05 || !pixel)
          behind = true;
        else if (const Vector2d n(p.x() / p.z(), p.y() / p.z()); n.norm() < 1.2)  // the distortion folds beyond
          seen.extend(*pixel);
      }
    if (seen.isEmpty()) continue;
    Board board;
    board.print = placed.print;
    board.tMw = placed.wMt.inverse().cast<float>();
    board.front = (board.tMw * view.centre()).z() < 0;
    const double margin = behind ? 1e4 : reach + 2;
    board.left = std::clamp(static_cast<int>(seen.min().x() - margin), 0, view.width());
    board.right = std::clamp(static_cast<int>(seen.max().x() + margin) + 1, 0, view.width());
    board.top = std::clamp(static_cast<int>(seen.min().y() - margin), 0, view.height());
    board.bottom = std::clamp(static_cast<int>(seen.max().y() + margin) + 1, 0, view.height());
    if (board.left >= board.right || board.top >= board.bottom) continue;
    const Vector3f normal = (placed.wMt.linear() * Vector3d(0, 0, board.front ? -1 : 1)).cast<float>();
    for (int k = 0; k < kNodes * kNodes; ++k) {
      const Vector3f p =
          (placed.wMt * at(k % kNodes / double{kNodes - 1}, k / kNodes / double{kNodes - 1})).cast<float>();
      const float distance = (p - view.centre()).norm();
      const Rgb e = radiometry.direct(p, normal) + radiometry.open_water(p) * (0.65f + 0.35f * normal.z());
      board.nodes[k].light << e * radiometry.transmission(distance), 0;
      board.nodes[k].veil << radiometry.veil(distance), 0;
    }
    board.pixels.resize(static_cast<std::size_t>(board.right - board.left) * (board.bottom - board.top));
    constexpr int kRows = 32;
    tbb::parallel_for(0, (board.bottom - board.top + kRows - 1) / kRows, [&](int strip) {
      const int first = board.top + strip * kRows;
      sample(board, first, std::min(first + kRows, board.bottom), filter);
    });
    boards_.push_back(std::move(board));
  }
}

float BoardLayer::Board::range(const CameraView::Sight& ray_t) const {
  const float t = -ray_t.origin.z() / ray_t.direction.z();
  if (!(t > 0 && t < kNoBoard)) return kNoBoard;
  const Vector3f p = ray_t.origin + t * ray_t.direction;
  return print->covers(p.x(), p.y()) ? t : kNoBoard;
}

float BoardLayer::range(const CameraView::Sight& ray) const {
  float nearest = kNoBoard;
  for (const Board& board : boards_) nearest = std::min(nearest, board.range(board.on_board(ray)));
  return nearest;
}

/// Added up in the order in which Eigen does for a single Sight: the same bits.
CameraView::FourSights BoardLayer::Board::on_board(const CameraView::FourSights& four) const {
  CameraView::FourSights on;
  const auto &o = four.origin, &d = four.direction;
  for (int k = 0; k < 3; ++k) {
    on.origin.col(k) = tMw(k, 0) * o.col(0) + tMw(k, 1) * o.col(1) + tMw(k, 2) * o.col(2) + tMw(k, 3);
    on.direction.col(k) = tMw(k, 0) * d.col(0) + (tMw(k, 1) * d.col(1) + tMw(k, 2) * d.col(2));
  }
  return on;
}

Eigen::Array4f BoardLayer::Board::radiance(float albedo, float x, float y) const {
  const float u = std::clamp(x, 0.0f, 1.0f) * (kNodes - 1), v = std::clamp(y, 0.0f, 1.0f) * (kNodes - 1);
  const int i = std::min(kNodes - 2, static_cast<int>(u)), j = std::min(kNodes - 2, static_cast<int>(v));
  const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
  const Node* here = nodes.data() + j * kNodes + i;
  const Node* below = here + kNodes;
  const auto at = [&](Eigen::Array4f Node::*what) -> Eigen::Array4f {
    return (1 - fv) * ((1 - fu) * here[0].*what + fu * here[1].*what) +
           fv * ((1 - fu) * below[0].*what + fu * below[1].*what);
  };
  return albedo * at(&Node::light) + at(&Node::veil);
}

[[gnu::flatten]] void BoardLayer::sample_row(const Board& board, int y, const PixelFilter& filter,
                                             std::vector<Eigen::Array4f>& fine, Eigen::Array4f* out) const {
  const int margin = (filter.reach + kPerPixel - 1) / kPerPixel, left = board.left - margin;
  const float v = (static_cast<float>(y) + 0.5f) / kPerPixel - 0.5f;
  const int row = std::clamp(y / kPerPixel, 0, view_->height() - 1);
  const Eigen::Array2f size = board.print->size().cast<float>(), origin = board.print->from().cast<float>();
  fine.assign(static_cast<std::size_t>(board.right + margin - left) * kPerPixel, Eigen::Array4f::Zero());
  for (int u = left; u < board.right + margin; ++u) {
    const auto ray = board.on_board(view_->quarter_sights(u, v));
    const float behind = std::min(kNoBoard, view_->range(std::clamp(u, 0, view_->width() - 1), row));
    const Eigen::Array4f t = -ray.origin.col(2) / ray.direction.col(2);
    if (!(t > 0 && t < behind).any()) continue;
    const Eigen::Array4f x = ray.origin.col(0) + t * ray.direction.col(0),
                         y_t = ray.origin.col(1) + t * ray.direction.col(1);
    for (int k = 0; k < kPerPixel; ++k) {
      if (!(t[k] > 0 && t[k] < behind && board.print->covers(x[k], y_t[k]))) continue;
      const float albedo = board.front ? board.print->albedo(x[k], y_t[k]) : kBackAlbedo;
      Eigen::Array4f& sample = fine[(u - left) * kPerPixel + k];
      sample = board.radiance(albedo, (x[k] - origin.x()) / size.x(), (y_t[k] - origin.y()) / size.y());
      sample[3] = 1;
    }
  }
  for (int u = board.left; u < board.right; ++u) {
    Eigen::Array4f sum = Eigen::Array4f::Zero();
    const Eigen::Array4f* in = fine.data() + static_cast<std::ptrdiff_t>(u - left) * kPerPixel - filter.reach;
    for (int i = 0; i < filter.size(); ++i) sum += filter.weights[i] * in[i];
    out[u - board.left] = sum;
  }
}

void BoardLayer::sample(Board& board, int first, int last, const PixelFilter& filter) const {
  const int width = board.right - board.left;
  const int fine_top = first * kPerPixel - filter.reach, fine_rows = (last - first) * kPerPixel + 2 * filter.reach;
  std::vector<Eigen::Array4f> fine, narrow(static_cast<std::size_t>(fine_rows) * width);
  for (int y = 0; y < fine_rows; ++y)
    sample_row(board, fine_top + y, filter, fine, narrow.data() + static_cast<std::ptrdiff_t>(y) * width);
  for (int v = first; v < last; ++v)
    for (int u = 0; u < width; ++u) {
      Eigen::Array4f sum = Eigen::Array4f::Zero();
      for (int i = 0; i < filter.size(); ++i)
        sum += filter.weights[i] * narrow[static_cast<std::size_t>((v - first) * kPerPixel + i) * width + u];
      board.pixels[static_cast<std::size_t>(v - board.top) * width + u] = sum;
    }
}

void BoardLayer::cover(const Board& board, int first, int count, float* rows, float light) const {
  const int width = board.right - board.left, channels = view_->channels();
  for (int v = std::max(first, board.top); v < std::min(first + count, board.bottom); ++v)
    for (int u = 0; u < width; ++u) {
      const Eigen::Array4f& sum = board.pixels[static_cast<std::size_t>(v - board.top) * width + u];
      if (sum[3] <= 0) continue;
      const auto value = view_->response(sum.head<3>() * (light * view_->scale()));
      float* out = rows + (static_cast<std::size_t>(v - first) * view_->width() + board.left + u) * channels;
      for (int c = 0; c < channels; ++c) out[c] += value[c] - sum[3] * out[c];
    }
}

void BoardLayer::cover(int first, int count, float* rows, float light) const {
  for (const Board& board : boards_) cover(board, first, count, rows, light);
}

}  // namespace tankrig::sim
