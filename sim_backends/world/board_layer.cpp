// Samples a board's print sixteen times a pixel and filters it as the optics do.
#include "sim_backends/world/board_layer.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace tankrig::sim {
namespace {

constexpr int kPerPixel = 4;  ///< samples along a pixel's side
constexpr float kNoBoard = 1e3f;
constexpr float kBackAlbedo = 0.3f;

Rgb bilinear(const auto& nodes, int side, float x, float y) {
  const float u = std::clamp(x, 0.0f, 1.0f) * static_cast<float>(side - 1),
              v = std::clamp(y, 0.0f, 1.0f) * static_cast<float>(side - 1);
  const int i = std::min(side - 2, static_cast<int>(u)), j = std::min(side - 2, static_cast<int>(v));
  const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
  const auto at = [&](int a, int b) -> const Rgb& { return nodes[(j + b) * side + i + a]; };
  return (1 - fv) * ((1 - fu) * at(0, 0) + fu * at(1, 0)) + fv * ((1 - fu) * at(0, 1) + fu * at(1, 1));
}

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
      board.light[k] = e * radiometry.transmission(distance);
      board.veil[k] = radiometry.veil(distance);
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

[[gnu::flatten]] void BoardLayer::sample_row(const Board& board, int y, const PixelFilter& filter,
                                             std::vector<Eigen::Array4f>& fine, Eigen::Array4f* out) const {
  const int from = board.left * kPerPixel - filter.reach, to = board.right * kPerPixel + filter.reach;
  const float v = (static_cast<float>(y) + 0.5f) / kPerPixel - 0.5f;
  const int row = std::clamp(y / kPerPixel, 0, view_->height() - 1);
  const Vector2d size = board.print->size(), origin = board.print->from();
  fine.assign(to - from, Eigen::Array4f::Zero());
  for (int x = from; x < to; ++x) {
    const float u = (static_cast<float>(x) + 0.5f) / kPerPixel - 0.5f;
    const int column = std::clamp((x < 0 ? 0 : x) / kPerPixel, 0, view_->width() - 1);
    const CameraView::Sight ray = board.on_board(view_->sight(u, v));
    const float t = board.range(ray);
    if (t >= view_->range(column, row)) continue;
    const Vector3f p = ray.origin + t * ray.direction;
    const float albedo = board.front ? board.print->albedo(p.x(), p.y()) : kBackAlbedo;
    const float px = (p.x() - static_cast<float>(origin.x())) / static_cast<float>(size.x()),
                py = (p.y() - static_cast<float>(origin.y())) / static_cast<float>(size.y());
    Eigen::Array4f& sample = fine[x - from];
    sample.head<3>() = albedo * bilinear(board.light, kNodes, px, py) + bilinear(board.veil, kNodes, px, py);
    sample[3] = 1;
  }
  for (int u = board.left; u < board.right; ++u) {
    Eigen::Array4f sum = Eigen::Array4f::Zero();
    const Eigen::Array4f* in = fine.data() + static_cast<std::ptrdiff_t>(u - board.left) * kPerPixel;
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
