// Traces a camera's rays once: quarter pixels for the light, sixteenths for edges and texture.
#include "sim_backends/world/camera_view.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sim_backends/world/ambient_grid.hpp"
#include "sim_backends/world/port_rays.hpp"

namespace tankrig::sim {
namespace {

constexpr int kFine = 4;  ///< samples along a pixel's side for texture and edges
constexpr int kFinePerQuarter = kFine / CameraView::kSub;
constexpr float kNowhere = 1e3f;  ///< range of a ray that meets nothing [m]

}  // namespace

float digital_numbers_per_lux(const CameraSpec& spec) {
  return static_cast<float>(255 * spec.sensor.electrons_per_lux_s * spec.exposure_s / spec.sensor.full_well_e);
}

/// What the quarter pixels see, row-major, and the ambient light on it.
struct CameraView::Trace {
  int columns, rows;
  std::vector<SurfaceHit> hits;
  const SurfaceHit& at(int x, int y) const { return hits[static_cast<std::size_t>(y) * columns + x]; }

  /// Is the neighbourhood of (x, y) one flat piece, so that rays between need no tracing?
  bool flat(int x, int y) const {
    if (x == 0 || y == 0 || x == columns - 1 || y == rows - 1) return false;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        if (!same_plane(at(x, y), at(x + dx, y + dy))) return false;
    return true;
  }
};

CameraView::CameraView(const CameraSpec& spec, const RenderGeometry& geometry, const Radiometry& radiometry)
    : spec_(spec),
      centre_(spec.wMc.translation().cast<float>()),
      wRc_(spec.wMc.linear().cast<float>()),
      scale_(digital_numbers_per_lux(spec)),
      laser_filter_(spec.psf_sigma_px, kSub),
      cells_x_((spec.model.width + kCell - 1) / kCell),
      cells_y_((spec.model.height + kCell - 1) / kCell) {
  const int w = width(), h = height();
  corners_.resize(static_cast<std::size_t>(w + 1) * (h + 1));
  tbb::parallel_for(0, h + 1, [&](int v) {
    for (int u = 0; u <= w; ++u)
      corners_[static_cast<std::size_t>(v) * (w + 1) + u] = spec_.model.normalized(u - 0.5, v - 0.5).cast<float>();
  });
  Trace quarters{w * kSub, h * kSub, {}};
  trace(geometry, radiometry, quarters);
  shade(geometry, radiometry, quarters);
}

std::array<float, 3> CameraView::response(const Rgb& colour) const {
  if (channels() == 1) return {0.25f * colour[0] + 0.5f * colour[1] + 0.25f * colour[2], 0, 0};
  return {colour[2], colour[1], colour[0]};
}

void CameraView::trace(const RenderGeometry& geometry, const Radiometry& radiometry, Trace& quarters) {
  quarters.hits.resize(static_cast<std::size_t>(quarters.columns) * quarters.rows);
  subs_.resize(static_cast<std::size_t>(cells_x_) * cells_y_ * kCellSub * kCellSub);
  boxes_.resize(static_cast<std::size_t>(cells_x_) * cells_y_);
  ranges_.resize(static_cast<std::size_t>(width()) * height());
  tbb::parallel_for(0, cells_y_, [&](int cell_y) {
    const int end = std::min(quarters.rows, (cell_y + 1) * kCellSub);
    for (int y = cell_y * kCellSub; y < end; ++y)
      for (int x = 0; x < quarters.columns; ++x) {
        const float u = (static_cast<float>(x) + 0.5f) / kSub - 0.5f, v = (static_cast<float>(y) + 0.5f) / kSub - 0.5f;
        const Sight ray = sight(u, v);
        const auto hit = geometry.intersect(ray.origin, ray.direction);
        float& range = ranges_[static_cast<std::size_t>(y / kSub) * width() + x / kSub];
        if (x % kSub == 0 && y % kSub == 0) range = hit ? hit->distance : kNowhere;
        if (!hit) continue;
        range = std::min(range, hit->distance);
        quarters.hits[static_cast<std::size_t>(y) * quarters.columns + x] = *hit;
        const int cell = cell_y * cells_x_ + x / kCellSub;
        SubPixel& sub =
            subs_[static_cast<std::size_t>(cell) * kCellSub * kCellSub + (y % kCellSub) * kCellSub + x % kCellSub];
        sub.p = hit->p;
        sub.gain = scale_ * geometry.albedo(*hit)[1] * std::exp(-radiometry.laser_attenuation() * hit->distance);
        for (int k = 0; k < 3; ++k) sub.normal[k] = static_cast<std::int16_t>(std::lround(32767 * hit->normal[k]));
        boxes_[cell].minimum = boxes_[cell].minimum.cwiseMin(hit->p);
        boxes_[cell].maximum = boxes_[cell].maximum.cwiseMax(hit->p);
      }
  });
}

/// Ambient light is looked up in a grid of every few pixels.
AmbientGrid CameraView::ambient_grid(const Trace& quarters, const Radiometry& radiometry) const {
  const int w = width(), h = height();
  const int columns = (w - 1) / AmbientGrid::kStep + 2, rows = (h - 1) / AmbientGrid::kStep + 2;
  std::vector<SurfaceHit> nodes;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      nodes.push_back(
          quarters.at(std::min(i * AmbientGrid::kStep, w - 1) * kSub, std::min(j * AmbientGrid::kStep, h - 1) * kSub));
  return AmbientGrid(std::move(nodes), columns, radiometry);
}

/// Each row of quarter pixels gives two rows of fine samples, filtered along the row at once; columns follow.
void CameraView::shade(const RenderGeometry& geometry, const Radiometry& radiometry, const Trace& quarters) {
  const int w = width(), c = channels();
  const AmbientGrid ambient = ambient_grid(quarters, radiometry);
  const PixelFilter filter(spec_.psf_sigma_px, kFine);
  std::vector<float> columns_left(static_cast<std::size_t>(height()) * kFine * w * c);
  tbb::parallel_for(0, quarters.rows, [&](int y) {
    std::vector<Rgb> fine(static_cast<std::size_t>(w) * kFine * kFinePerQuarter);
    shade_row(geometry, radiometry, ambient, quarters, y, fine);
    for (int row = 0; row < kFinePerQuarter; ++row)
      filter_row(filter, fine.data() + static_cast<std::size_t>(row) * w * kFine,
                 columns_left.data() + (static_cast<std::size_t>(y) * kFinePerQuarter + row) * w * c);
  });
  filter_columns(filter, columns_left);
}

void CameraView::shade_row(const RenderGeometry& geometry, const Radiometry& radiometry, const AmbientGrid& ambient,
                           const Trace& quarters, int y, std::vector<Rgb>& fine) const {
  constexpr int kPer = kFinePerQuarter;
  const int w = width();
  const Rgb sky = radiometry.surface_seen_from_below();
  for (int x = 0; x < quarters.columns; ++x) {
    const SurfaceHit& centre_hit = quarters.at(x, y);
    const bool flat = quarters.flat(x, y);
    const auto illuminance = [&](const SurfaceHit& hit, float u, float v) -> Rgb {
      return radiometry.direct(hit.p, hit.normal) + ambient.at(hit, u, v);
    };
    const float centre_u = (static_cast<float>(x) + 0.5f) / kSub - 0.5f,
                centre_v = (static_cast<float>(y) + 0.5f) / kSub - 0.5f;
    const Rgb centre_e = centre_hit.surface >= 0 ? illuminance(centre_hit, centre_u, centre_v) : Rgb(Rgb::Zero());
    const Rgb centre_transmission = radiometry.transmission(centre_hit.distance);
    const Rgb centre_veil = radiometry.veil(centre_hit.distance);
    for (int k = 0; k < kPer * kPer; ++k) {
      const int fine_x = x * kPer + k % kPer, fine_y = k / kPer;
      const float u = (static_cast<float>(fine_x) + 0.5f) / kFine - 0.5f;
      const float v = (static_cast<float>(y * kPer + fine_y) + 0.5f) / kFine - 0.5f;
      const Sight ray = sight(u, v);
      SurfaceHit hit = centre_hit;
      bool found = true;
      if (flat) {
        hit.distance = hit.normal.dot(hit.p - ray.origin) / hit.normal.dot(ray.direction);
        hit.p = ray.origin + hit.distance * ray.direction;
      } else if (const auto traced = geometry.intersect(ray.origin, ray.direction)) {
        hit = *traced;
      } else {
        found = false;
      }
      Rgb& out = fine[static_cast<std::size_t>(fine_y) * w * kFine + fine_x];
      if (!found) {
        out = sky;
      } else if (flat || same_plane(hit, centre_hit)) {
        out = geometry.albedo(hit) * centre_e * centre_transmission + centre_veil;
      } else {
        out = geometry.albedo(hit) * illuminance(hit, u, v) * radiometry.transmission(hit.distance) +
              radiometry.veil(hit.distance);
      }
    }
  }
}

void CameraView::filter_row(const PixelFilter& filter, const Rgb* in, float* out) const {
  const int w = width(), c = channels();
  for (int u = 0; u < w; ++u) {
    Rgb sum = Rgb::Zero();
    float weight = 0;
    for (int i = 0; i < filter.size(); ++i) {
      const int x = u * kFine + i - filter.reach;
      if (x < 0 || x >= w * kFine) continue;
      sum += filter.weights[i] * in[x];
      weight += filter.weights[i];
    }
    const auto channel = response(sum * (scale_ / weight));
    for (int k = 0; k < c; ++k) out[u * c + k] = channel[k];
  }
}

void CameraView::filter_columns(const PixelFilter& filter, const std::vector<float>& columns_left) {
  const int w = width(), h = height(), c = channels();
  radiance_.resize(static_cast<std::size_t>(h) * w * c);
  tbb::parallel_for(0, h, [&](int v) {
    float* out = radiance_.data() + static_cast<std::size_t>(v) * w * c;
    float weight = 0;
    for (int i = 0; i < filter.size(); ++i) {
      const int y = v * kFine + i - filter.reach;
      if (y < 0 || y >= h * kFine) continue;
      weight += filter.weights[i];
      const float* in = columns_left.data() + static_cast<std::size_t>(y) * w * c;
      for (int k = 0; k < w * c; ++k) out[k] += filter.weights[i] * in[k];
    }
    for (int k = 0; k < w * c; ++k) out[k] /= weight;
  });
}

}  // namespace tankrig::sim
