// Lights the sub-pixels that the sheet meets, tile by tile.
#include "sim_backends/world/laser_layer.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim_backends/world/laser_speckle.hpp"

namespace tankrig::sim {
namespace {

constexpr float kSections = 4.5f;    ///< standard deviations of the section at which the sheet is taken to end
constexpr float kDarkest = 0.01f;    ///< digital numbers below which a sub-pixel is left dark
constexpr float kFaintGlow = 0.05f;  ///< digital numbers below which the glow is left out

}  // namespace

LaserLayer::LaserLayer(const CameraView& view, const LaserSheet& sheet, const ExposedSheet& exposed,
                       const RenderGeometry& geometry, float water_scattering)
    : view_(&view),
      tiles_x_((view.width() + kTile - 1) / kTile),
      tiles_y_((view.height() + kTile - 1) / kTile),
      tile_index_(static_cast<std::size_t>(tiles_x_) * tiles_y_, -1) {
  if (exposed.total_power() <= 0) return;
  find_tiles(exposed, sheet);
  tiles_.resize(tile_at_.size());
  tbb::parallel_for(std::size_t{0}, tiles_.size(), [&](std::size_t i) {
    light_tile(tile_at_[i].first, tile_at_[i].second, tiles_[i], sheet, exposed, geometry);
  });
  make_glow(sheet, exposed, geometry, water_scattering);
}

bool LaserLayer::cell_touched(int cell_x, int cell_y, const ExposedSheet& exposed, const LaserSheet& sheet) const {
  const CellBox& box = view_->cell_box(cell_x, cell_y);
  const Vector3f half = 0.5f * (box.maximum - box.minimum);
  if (half.x() < 0) return false;
  const Vector3f middle = 0.5f * (box.maximum + box.minimum);
  for (int k = 0; k < ExposedSheet::kSamples; ++k) {
    if (exposed.power[k] <= 0) continue;
    const SheetPose& pose = exposed.pose[k];
    const float extent = half.dot(pose.normal.cwiseAbs());
    const float range = (middle - pose.exit).norm() + half.norm();
    // A patch as large as a sub-pixel widens the section: half the cell's extent covers it.
    if (std::abs(pose.distance(middle)) < 1.5f * extent + kSections * sheet.sigma(range)) return true;
  }
  return false;
}

void LaserLayer::find_tiles(const ExposedSheet& exposed, const LaserSheet& sheet) {
  constexpr int kCells = kTile / CameraView::kCell;
  for (int ty = 0; ty < tiles_y_; ++ty)
    for (int tx = 0; tx < tiles_x_; ++tx) {
      bool touched = false;
      for (int k = 0; k < kCells * kCells && !touched; ++k) {
        const int cx = tx * kCells + k % kCells, cy = ty * kCells + k / kCells;
        touched = cx < view_->cells_x() && cy < view_->cells_y() && cell_touched(cx, cy, exposed, sheet);
      }
      if (!touched) continue;
      tile_index_[ty * tiles_x_ + tx] = static_cast<int>(tile_at_.size());
      tile_at_.emplace_back(tx, ty);
    }
}

void LaserLayer::light_tile(int tile_x, int tile_y, Tile& tile, const LaserSheet& sheet, const ExposedSheet& exposed,
                            const RenderGeometry& geometry) const {
  constexpr int kCells = kTile / CameraView::kCell, kSide = CameraView::kCellSub;
  const SheetPose& middle = exposed.pose[ExposedSheet::kSamples / 2];
  for (int k = 0; k < kCells * kCells; ++k) {
    const int cx = tile_x * kCells + k % kCells, cy = tile_y * kCells + k / kCells;
    if (cx >= view_->cells_x() || cy >= view_->cells_y() || !cell_touched(cx, cy, exposed, sheet)) continue;
    const SubPixel* subs = view_->cell(cx, cy);
    std::array<std::array<float, kSide * kSide>, ExposedSheet::kSamples> x;
    for (int s = 0; s < ExposedSheet::kSamples; ++s)
      for (int i = 0; i < kSide * kSide; ++i) x[s][i] = exposed.pose[s].distance(subs[i].p);
    const auto& mid = x[ExposedSheet::kSamples / 2];
    // Change of the distance from one sub-pixel to the next, on whichever side there is no depth edge.
    const auto slope = [&](int i, int step, int position) {
      const float before = position > 0 ? std::abs(mid[i] - mid[i - step]) : 1e3f;
      const float after = position < kSide - 1 ? std::abs(mid[i + step] - mid[i]) : 1e3f;
      return std::min(before, after);
    };
    for (int i = 0; i < kSide * kSide; ++i) {
      const SubPixel& sub = subs[i];
      if (sub.gain <= 0) continue;
      const Vector3f to = sub.p - middle.exit;
      const float forward = middle.forward.dot(to);
      if (forward <= kExitClearance) continue;
      const float sigma = sheet.sigma(to.norm());
      const float du = slope(i, 1, i % kSide), dv = slope(i, kSide, i / kSide);
      const float variance = (du * du + dv * dv) / 12;
      const float reach = kSections * std::sqrt(sigma * sigma + variance);
      if (std::min({std::abs(x[0][i]), std::abs(x[1][i]), std::abs(x[2][i])}) > reach) continue;
      const Vector3f normal =
          Eigen::Map<const Eigen::Matrix<std::int16_t, 3, 1>>(sub.normal.data()).cast<float>() / 32767;
      float light = 0;
      for (int s = 0; s < ExposedSheet::kSamples; ++s) {
        if (exposed.power[s] <= 0 || std::abs(x[s][i]) > reach) continue;
        const SheetPose& pose = exposed.pose[s];
        const Vector3f way = sub.p - pose.exit;
        const float range = way.norm(), cos_incidence = -normal.dot(way) / range;
        if (cos_incidence <= 0) continue;
        const float tan_angle = pose.across.dot(way) / std::max(pose.forward.dot(way), 1e-6f);
        light += exposed.power[s] * cos_incidence * sheet.illuminance(range, tan_angle, x[s][i], variance);
      }
      light *= sub.gain;
      if (light < kDarkest || !laser_reaches(middle, sub.p, normal, geometry, exposed.blockers)) continue;
      const int u = (k % kCells) * kSide + i % kSide, v = (k / kCells) * kSide + i / kSide;
      tile.light[v * kTileSub + u] = light;
      tile.lit_left = std::min(tile.lit_left, u), tile.lit_right = std::max(tile.lit_right, u);
      tile.lit_top = std::min(tile.lit_top, v), tile.lit_bottom = std::max(tile.lit_bottom, v);
    }
  }
}

void LaserLayer::add_stripe(int tile_row, float* rows, const std::array<float, 3>& colour, float speckle_contrast,
                            std::uint64_t speckle_key) const {
  if (tiles_.empty()) return;
  const PixelFilter& filter = view_->laser_filter();
  const int reach = filter.reach, channels = view_->channels();
  constexpr int kSub = CameraView::kSub, kMaxReach = kTileSub;
  const int height = std::min(kTile, view_->height() - tile_row * kTile);
  std::array<float, (kTileSub + 2 * kMaxReach) * kTile> narrow;  // filtered along rows: sub-rows x pixels
  for (int tx = 0; tx < tiles_x_; ++tx) {
    // The neighbours' light that the filter brings here, in sub-pixels from this tile's corner.
    int top = 1 << 20, bottom = -(1 << 20);
    std::array<const Tile*, 9> around{};
    for (int k = 0; k < 9; ++k) {
      const int nx = tx + k % 3 - 1, ny = tile_row + k / 3 - 1;
      if (nx < 0 || ny < 0 || nx >= tiles_x_ || ny >= tiles_y_) continue;
      const int index = tile_index_[ny * tiles_x_ + nx];
      if (index < 0 || tiles_[index].lit_right < 0) continue;
      const Tile& t = tiles_[index];
      const int ox = (k % 3 - 1) * kTileSub, oy = (k / 3 - 1) * kTileSub;
      if (ox + t.lit_right < -reach || ox + t.lit_left >= kTileSub + reach) continue;
      if (oy + t.lit_bottom < -reach || oy + t.lit_top >= kTileSub + reach) continue;
      around[k] = &t;
      top = std::min(top, std::max(oy + t.lit_top, -reach));
      bottom = std::max(bottom, std::min(oy + t.lit_bottom, kTileSub + reach - 1));
    }
    if (top > bottom) continue;
    for (int y = top; y <= bottom; ++y) {
      std::array<float, kTileSub + 2 * kMaxReach> line{};
      const int row_tile = (y + kTileSub) / kTileSub, in_tile = y - (row_tile - 1) * kTileSub;
      bool lit = false;
      for (int k = 0; k < 3; ++k) {
        const Tile* t = around[row_tile * 3 + k];
        if (!t || in_tile < t->lit_top || in_tile > t->lit_bottom) continue;
        const int ox = (k - 1) * kTileSub;
        const int from = std::max(t->lit_left, -reach - ox), to = std::min(t->lit_right, kTileSub + reach - 1 - ox);
        for (int x = from; x <= to; ++x) line[reach + ox + x] = t->light[in_tile * kTileSub + x];
        lit = true;
      }
      float* out = narrow.data() + (y + reach) * kTile;
      std::fill(out, out + kTile, 0.0f);
      if (!lit) continue;
      for (int u = 0; u < kTile; ++u)
        for (int i = 0; i < filter.size(); ++i) out[u] += filter.weights[i] * line[u * kSub + i];
    }
    const int first = std::max(0, (top - reach - kSub + 1 + kTileSub) / kSub - kTile);
    const int last = std::min(height - 1, (bottom + reach) / kSub);
    const int width = std::min(kTile, view_->width() - tx * kTile);
    const SpeckleTile<kTile> speckle(speckle_key, tx * kTile, tile_row * kTile, speckle_contrast);
    for (int v = first; v <= last; ++v) {
      std::array<float, kTile> sum{};
      for (int i = 0; i < filter.size(); ++i) {
        const int y = v * kSub + i - reach;
        if (y < top || y > bottom) continue;
        const float* in = narrow.data() + (y + reach) * kTile;
        for (int u = 0; u < kTile; ++u) sum[u] += filter.weights[i] * in[u];
      }
      float* out = rows + (static_cast<std::size_t>(v) * view_->width() + tx * kTile) * channels;
      for (int u = 0; u < width; ++u) {
        if (sum[u] <= 0) continue;
        const float value = sum[u] * speckle.at(u, v);
        for (int c = 0; c < channels; ++c) out[u * channels + c] += value * colour[c];
      }
    }
  }
}

void LaserLayer::make_glow(const LaserSheet& sheet, const ExposedSheet& exposed, const RenderGeometry& geometry,
                           float scattering) {
  if (scattering <= 0) return;
  const SheetPose& pose = exposed.pose[ExposedSheet::kSamples / 2];
  const int columns = tiles_x_ + 1, rows = tiles_y_ + 1;
  std::vector<float> glow(static_cast<std::size_t>(columns) * rows);
  const float factor = std::numbers::pi_v<float> * scattering * exposed.total_power() * view_->scale();
  tbb::parallel_for(0, rows, [&](int j) {
    for (int i = 0; i < columns; ++i) {
      const int u = std::min(i * kTile, view_->width() - 1), v = std::min(j * kTile, view_->height() - 1);
      const CameraView::Sight ray = view_->sight(static_cast<float>(u), static_cast<float>(v));
      const float approach = -pose.normal.dot(ray.direction);
      const float t = pose.distance(ray.origin) / (std::abs(approach) > 1e-6f ? approach : 1e-6f);
      if (!(t > 0) || t >= view_->range(u, v)) continue;
      const Vector3f p = ray.origin + t * ray.direction, way = p - pose.exit;
      const float range = way.norm(), forward = pose.forward.dot(way);
      if (forward <= kExitClearance) continue;
      const float density = sheet.line_density(range, pose.across.dot(way) / forward);
      const float value = factor * density / std::max(std::abs(approach), 0.05f) * std::exp(-sheet.attenuation() * t);
      if (value < kFaintGlow || !laser_reaches(pose, p, Vector3f::Zero(), geometry, exposed.blockers)) continue;
      glow[static_cast<std::size_t>(j) * columns + i] = value;
    }
  });
  if (std::any_of(glow.begin(), glow.end(), [](float g) { return g > 0; })) glow_ = std::move(glow);
}

void LaserLayer::add_glow(int tile_row, float* rows, const std::array<float, 3>& colour) const {
  if (glow_.empty()) return;
  const int columns = tiles_x_ + 1, channels = view_->channels();
  const int height = std::min(kTile, view_->height() - tile_row * kTile);
  const float* above = glow_.data() + static_cast<std::size_t>(tile_row) * columns;
  const float* below = above + columns;
  for (int tx = 0; tx < tiles_x_; ++tx) {
    if (above[tx] + above[tx + 1] + below[tx] + below[tx + 1] <= 0) continue;
    const int width = std::min(kTile, view_->width() - tx * kTile);
    for (int v = 0; v < height; ++v) {
      const float down = static_cast<float>(v) / kTile;
      const float left = above[tx] + down * (below[tx] - above[tx]);
      const float step = (above[tx + 1] + down * (below[tx + 1] - above[tx + 1]) - left) / kTile;
      float* out = rows + (static_cast<std::size_t>(v) * view_->width() + tx * kTile) * channels;
      for (int u = 0; u < width; ++u) {
        const float value = left + step * static_cast<float>(u);
        for (int c = 0; c < channels; ++c) out[u * channels + c] += value * colour[c];
      }
    }
  }
}

}  // namespace tankrig::sim
