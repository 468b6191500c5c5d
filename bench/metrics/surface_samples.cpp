#include "bench/metrics/surface_samples.hpp"

#include <array>
#include <cmath>

namespace tankrig {
namespace {

using Corners = std::array<Vector3d, 3>;

/// The `index`-th number of a fixed sequence, uniform in [0, 1) (splitmix64).
double uniform(std::uint64_t index) {
  std::uint64_t z = (index + 1) * 0x9E3779B97F4A7C15ull;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

double area(const Corners& c) { return 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm(); }

class Sampler {
 public:
  Sampler(double longest_edge, double whole_area, std::vector<SurfaceSample>& out)
      : longest_squared_(longest_edge * longest_edge), whole_area_(whole_area), out_(out) {}

  void cut(const Corners& c, std::uint32_t triangle) {
    int longest = 0;
    double squared[3];
    for (int k = 0; k < 3; ++k) {
      squared[k] = (c[(k + 1) % 3] - c[k]).squaredNorm();
      if (squared[k] > squared[longest]) longest = k;
    }
    if (squared[longest] <= longest_squared_) return emit(c, triangle);
    const Vector3d &from = c[longest], &to = c[(longest + 1) % 3], &apex = c[(longest + 2) % 3];
    const Vector3d middle = 0.5 * (from + to);
    cut({from, middle, apex}, triangle);
    cut({middle, to, apex}, triangle);
  }

 private:
  void emit(const Corners& c, std::uint32_t triangle) {
    const double root = std::sqrt(uniform(2 * out_.size())), v = uniform(2 * out_.size() + 1);
    const Vector3d p = (1 - root) * c[0] + root * (1 - v) * c[1] + root * v * c[2];
    out_.push_back({p, triangle, static_cast<float>(area(c) / whole_area_)});
  }

  double longest_squared_, whole_area_;
  std::vector<SurfaceSample>& out_;
};

}  // namespace

std::vector<SurfaceSample> sample_surface(const TriangleMesh& mesh, std::size_t count) {
  const double whole_area = mesh.area();
  const double patch = whole_area / static_cast<double>(count);
  constexpr double kEdgePerRoot = 2.3;  // longest edge / sqrt(mean patch area) when halving ends, measured on boxes
  std::vector<SurfaceSample> samples;
  samples.reserve(count + count / 2 + mesh.triangles.size());
  Sampler sampler(kEdgePerRoot * std::sqrt(patch), whole_area, samples);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3i& t = mesh.triangles[i];
    sampler.cut({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}, static_cast<std::uint32_t>(i));
  }
  return samples;
}

double stratified_sigma(const std::vector<double>& contributions) {
  double variance = 0;
  for (std::size_t i = 1; i < contributions.size(); i += 2) {
    const double difference = contributions[i] - contributions[i - 1];
    variance += difference * difference;
  }
  if (contributions.size() % 2 == 1 && contributions.size() > 1) {
    const double difference = contributions[contributions.size() - 1] - contributions[contributions.size() - 2];
    variance += 0.5 * difference * difference;
  }
  return std::sqrt(variance);
}

}  // namespace tankrig
