#include "reconstruction/stripe/particle_filter.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace tankrig {
namespace {

struct Cell {
  std::int64_t x, y, z;
  friend auto operator<=>(const Cell&, const Cell&) = default;
};

struct Span {
  std::size_t begin, end;
};

/// Runs of consecutive points in one frame and one cubic cell, sorted by cell.
class CellGrid {
 public:
  /// Indices of consecutive points.
  struct Run {
    Cell cell;
    std::size_t first, last;  ///< points [first, last)
    friend auto operator<=>(const Run&, const Run&) = default;
  };

  CellGrid(const std::vector<CloudPoint>& points, double size) : size_(size) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Cell cell = cell_of(points[i].p);
      if (i > 0 && runs_.back().cell == cell && points[i].frame == points[i - 1].frame)
        runs_.back().last = i + 1;
      else
        runs_.push_back({cell, i, i + 1});
    }
    std::sort(runs_.begin(), runs_.end());
  }

  const std::vector<Run>& runs() const { return runs_; }

  /// Runs of the 27 cells around run `k`: pieces of the list, in the order of searching. The first starts with the
  /// run itself, since what lies next to it most likely confirms it.
  std::array<Span, 10> around(std::size_t k) const {
    const Cell centre = runs_[k].cell;
    const Span own = column(centre);
    std::array<Span, 10> spans{{{k, own.end}, {own.begin, k}}};
    std::size_t next = 2;
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      for (std::int64_t dy = -1; dy <= 1; ++dy)
        if (dx != 0 || dy != 0) spans[next++] = column({centre.x + dx, centre.y + dy, centre.z});
    return spans;
  }

 private:
  Cell cell_of(const Vector3d& p) const {
    return {static_cast<std::int64_t>(std::floor(p.x() / size_)), static_cast<std::int64_t>(std::floor(p.y() / size_)),
            static_cast<std::int64_t>(std::floor(p.z() / size_))};
  }

  /// Runs in the cell, the one below and the one above.
  Span column(const Cell& middle) const {
    const auto at = [&](std::int64_t z) {
      const auto found = std::lower_bound(runs_.begin(), runs_.end(), Run{{middle.x, middle.y, z}, 0, 0});
      return static_cast<std::size_t>(found - runs_.begin());
    };
    return {at(middle.z - 1), at(middle.z + 2)};
  }

  double size_;
  std::vector<Run> runs_;
};

}  // namespace

std::vector<bool> confirmed_points(const std::vector<CloudPoint>& points, double radius, int run) {
  const CellGrid grid(points, 2 * radius);
  std::vector<char> keep(points.size(), 0);
  const auto confirms = [&](std::size_t j, std::size_t i) {
    return points[j].frame != points[i].frame && (points[j].p - points[i].p).squaredNorm() <= radius * radius;
  };
  tbb::parallel_for(std::size_t{0}, grid.runs().size(), [&](std::size_t k) {
    const CellGrid::Run& mine = grid.runs()[k];
    const std::array<Span, 10> spans = grid.around(k);
    std::size_t witness = mine.first;  // what confirmed the point before most likely confirms this one, too
    const auto find_witness = [&](std::size_t i) {
      for (const Span& span : spans)
        for (std::size_t r = span.begin; r < span.end; ++r) {
          const CellGrid::Run& other = grid.runs()[r];
          if (points[other.first].frame == points[i].frame) continue;
          for (std::size_t j = other.first; j < other.last; ++j)
            if (confirms(j, i)) {
              witness = j;
              return true;
            }
        }
      return false;
    };
    const auto in_long_run = [&](std::size_t i) {
      int own = -1;  // the point finds itself
      for (const Span& span : spans)
        for (std::size_t r = span.begin; r < span.end; ++r) {
          const CellGrid::Run& other = grid.runs()[r];
          if (points[other.first].frame != points[i].frame) continue;
          for (std::size_t j = other.first; j < other.last; ++j)
            own += (points[j].p - points[i].p).squaredNorm() <= 4 * radius * radius;
        }
      return own >= run;
    };
    for (std::size_t i = mine.first; i < mine.last; ++i)
      keep[i] = confirms(witness, i) || find_witness(i) || in_long_run(i);
  });
  return {keep.begin(), keep.end()};
}

}  // namespace tankrig
