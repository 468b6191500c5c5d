#include "reconstruction/stripe/particle_filter.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tankrig {
namespace {

struct Cell {
  std::int64_t x, y, z;
  friend auto operator<=>(const Cell&, const Cell&) = default;
};

/// Points sorted by cubic cells of one size.
class CellGrid {
 public:
  CellGrid(const std::vector<CloudPoint>& points, double size) : size_(size), entries_(points.size()) {
    for (std::size_t i = 0; i < points.size(); ++i) entries_[i] = {cell_of(points[i].p), i};
    std::sort(entries_.begin(), entries_.end());
  }

  Cell cell_of(const Vector3d& p) const {
    return {static_cast<std::int64_t>(std::floor(p.x() / size_)), static_cast<std::int64_t>(std::floor(p.y() / size_)),
            static_cast<std::int64_t>(std::floor(p.z() / size_))};
  }

  /// Calls visit(index) for the points of the 27 cells around `p` until it returns false.
  template <class Visit>
  void around(const Vector3d& p, Visit&& visit) const {
    const Cell centre = cell_of(p);
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const Entry from{{centre.x + dx, centre.y + dy, centre.z - 1}, 0};
        const Cell last{centre.x + dx, centre.y + dy, centre.z + 1};
        for (auto i = std::lower_bound(entries_.begin(), entries_.end(), from); i != entries_.end() && i->cell <= last;
             ++i)
          if (!visit(i->index)) return;
      }
  }

 private:
  struct Entry {
    Cell cell;
    std::size_t index;
    friend auto operator<=>(const Entry&, const Entry&) = default;
  };
  double size_;
  std::vector<Entry> entries_;
};

}  // namespace

std::vector<bool> confirmed_points(const std::vector<CloudPoint>& points, double radius, int run) {
  const CellGrid grid(points, 2 * radius);
  std::vector<char> keep(points.size(), 0);
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    int own = -1;  // the point finds itself
    grid.around(points[i].p, [&](std::size_t j) {
      const double distance2 = (points[j].p - points[i].p).squaredNorm();
      if (points[j].frame == points[i].frame)
        own += distance2 <= 4 * radius * radius;
      else if (distance2 <= radius * radius)
        keep[i] = 1;
      if (own >= run) keep[i] = 1;
      return !keep[i];
    });
  });
  return {keep.begin(), keep.end()};
}

}  // namespace tankrig
