// Gauss-Newton on slanted windows, one window per pixel.
#include "reconstruction/stereo/slanted_refinement.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace tankrig {
namespace {

constexpr int kSubSteps = 8;           ///< samples per pixel of the interpolated right rows
constexpr float kMaxDriftPx = 1.0f;    ///< from the coarse disparity
constexpr double kConvergedPx = 0.01;  ///< the step after one of this size is ten times smaller
constexpr int kFewestSamples = 20;
constexpr int kDenseRadiusPx = 7;  ///< larger windows look at every other pixel: smoothing has made neighbours alike

/// The rows of the right image at kSubSteps samples per pixel, cubic in between; linear interpolation does the rest.
cv::Mat1f fine_rows(const cv::Mat1f& image) {
  cv::Mat1f fine(image.rows, image.cols * kSubSteps, NAN);
  tbb::parallel_for(0, image.rows, [&](int v) {
    const float* row = image[v];
    float* out = fine[v];
    for (int u = 1; u + 2 < image.cols; ++u) {
      const float p0 = row[u - 1], p1 = row[u], p2 = row[u + 1], p3 = row[u + 2];
      const float c1 = 0.5f * (p2 - p0);
      const float c2 = p0 - 2.5f * p1 + 2 * p2 - 0.5f * p3;
      const float c3 = 0.5f * (p3 - p0) + 1.5f * (p1 - p2);
      for (int k = 0; k < kSubSteps; ++k) {
        const float t = static_cast<float>(k) / kSubSteps;
        out[u * kSubSteps + k] = p1 + t * (c1 + t * (c2 + t * c3));
      }
    }
  });
  return fine;
}

/// The disparity plane of a window: d + a * (u - u0) + b * (v - v0).
struct DisparityPlane {
  float d = 0, a = 0, b = 0;
};

using Unknowns = Eigen::Matrix<double, 5, 1>;  ///< of a step: d, a, b, all times gain / (1 - a); gain; offset

/// One pixel's window: gathered once from the left image, compared again and again with the right.
class Window {
 public:
  Window(const cv::Mat1f& left, const cv::Mat1f& fine_right, const cv::Mat1f& coarse, int largest_radius,
         const SlantedRefinementParameters& parameters)
      : left_(left), fine_right_(fine_right), coarse_(coarse), parameters_(parameters) {
    const Eigen::Index most = (2 * largest_radius + 1) * (2 * largest_radius + 1);
    rows_.resize(static_cast<std::size_t>(most));
    offsets_.resize(most, 2);
    model_.resize(most, 5);
    right_.resize(most);
  }

  /// Lays the first plane through the coarse disparities. False if too few of them lie on one plane to fit five
  /// unknowns.
  bool place(int u0, int v0, int radius) {
    u0_ = u0;
    v0_ = v0;
    step_ = radius > kDenseRadiusPx ? 2 : 1;
    reach_ = radius / step_ * step_;
    plane_ = {coarse_(v0, u0), 0, 0};
    if (!fit_plane()) return false;
    gather();
    return samples_ >= kFewestSamples;
  }

  bool fit() {
    Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j <= i; ++j) normal(i, j) = column(i).dot(column(j));
    const Eigen::LLT<Eigen::Matrix<double, 5, 5>> solver(normal);
    if (solver.info() != Eigen::Success) return false;
    for (int i = 0; i < parameters_.iterations; ++i) {
      if (!look_right()) return false;
      const auto right = right_.head(samples_);
      Unknowns product;
      for (int j = 0; j < 5; ++j) product[j] = column(j).dot(right);
      const Unknowns x = solver.solve(product);
      if (!x.allFinite() || x[3] <= 0) return false;
      const double scale = (1 - plane_.a) / x[3];
      plane_.d += static_cast<float>(scale * x[0]);
      plane_.a += static_cast<float>(scale * x[1]);
      plane_.b += static_cast<float>(scale * x[2]);
      if (std::abs(plane_.d - coarse_(v0_, u0_)) > kMaxDriftPx) return false;
      if (std::abs(scale * x[0]) >= kConvergedPx) continue;
      const double energy = right.squaredNorm();
      squared_residuals_ = std::max(0.0, energy - product.dot(x));
      right_energy_ = energy - product[4] * product[4] / samples_;
      unit_variance_ = solver.solve(Unknowns::Unit(0))[0] * scale * scale / (step_ * step_);
      return true;
    }
    return false;
  }

  float disparity() const { return plane_.d; }
  float support() const {
    const int side = 2 * reach_ / step_ + 1;
    return static_cast<float>(samples_) / static_cast<float>(side * side);
  }
  double correlation() const {
    return right_energy_ > 0 ? std::sqrt(std::max(0.0, 1 - squared_residuals_ / right_energy_)) : 0.0;
  }
  double residual_variance() const { return squared_residuals_ / (samples_ - 5); }
  /// Variance of d for unit noise variance before smoothing. Pixels left out would not have lowered it.
  double unit_variance() const { return unit_variance_; }

 private:
  Eigen::Ref<const Eigen::VectorXf> column(int i) const { return model_.col(i).head(samples_); }

  /// Through the coarse disparities near the pixel's own. Float holds their sums exactly.
  bool fit_plane() {
    Eigen::Matrix3f A = Eigen::Matrix3f::Zero();
    Eigen::Vector3f y = Eigen::Vector3f::Zero();
    for_each_coarse(2.0f, [&](float du, float dv, int, int, float off) {
      A(0, 0) += 1;
      A(1, 0) += du;
      A(2, 0) += dv;
      A(1, 1) += du * du;
      A(2, 1) += du * dv;
      A(2, 2) += dv * dv;
      y += off * Eigen::Vector3f(1, du, dv);
    });
    if (A(0, 0) < kFewestSamples) return false;
    const Eigen::Vector3d p = A.cast<double>().llt().solve(y.cast<double>());
    plane_.a = static_cast<float>(p[1]);
    plane_.b = static_cast<float>(p[2]);
    return p.allFinite();
  }

  /// The left image's side of the equations: what right changes by with d, a and b; its grey; one.
  void gather() {
    samples_ = 0;
    for_each_coarse(parameters_.same_surface_px, [&](float du, float dv, int u, int v, float) {
      if (u < 2 || u + 2 >= left_.cols) return;
      const float* row = left_[v] + u;
      const float slope = (8 * (row[1] - row[-1]) - (row[2] - row[-2])) / 12;
      if (std::isnan(row[0]) || std::isnan(slope)) return;
      rows_[static_cast<std::size_t>(samples_)] = fine_right_[v];
      offsets_.row(samples_) << du, dv;
      model_.row(samples_++) << slope, slope * du, slope * dv, row[0], 1;
    });
    if (samples_ == 0) return;
    auto grey = model_.col(3).head(samples_);
    mean_grey_ = grey.mean();
    grey.array() -= mean_grey_;
  }

  template <class Visit>
  void for_each_coarse(float limit, Visit visit) const {
    const int first_v = -std::min(reach_, v0_ / step_ * step_), last_v = std::min(reach_, coarse_.rows - 1 - v0_);
    const int first_u = -std::min(reach_, u0_ / step_ * step_), last_u = std::min(reach_, coarse_.cols - 1 - u0_);
    for (int dv = first_v; dv <= last_v; dv += step_) {
      const float* row = coarse_[v0_ + dv] + u0_;
      for (int du = first_u; du <= last_u; du += step_) {
        const auto x = static_cast<float>(du), y = static_cast<float>(dv);
        const float off = row[du] - (plane_.d + plane_.a * x + plane_.b * y);
        if (std::abs(off) < limit) visit(x, y, u0_ + du, v0_ + dv, off);
      }
    }
  }

  /// The right image where the present plane sees the window. False if that is not all in the image.
  bool look_right() {
    const float centre = static_cast<float>(u0_) - plane_.d, along = 1 - plane_.a;
    for (int k = 0; k < samples_; ++k) {
      const float x = (centre + along * offsets_(k, 0) - plane_.b * offsets_(k, 1)) * kSubSteps;
      const int i = static_cast<int>(x);
      if (x < 0 || i + 1 >= fine_right_.cols) return false;
      const float* at = rows_[static_cast<std::size_t>(k)] + i;
      right_[k] = at[0] + (x - static_cast<float>(i)) * (at[1] - at[0]) - mean_grey_;
    }
    return true;
  }

  const cv::Mat1f& left_;
  const cv::Mat1f& fine_right_;
  const cv::Mat1f& coarse_;
  const SlantedRefinementParameters& parameters_;
  int u0_ = 0, v0_ = 0;
  int reach_ = 0, step_ = 1;  ///< the window: pixels that are multiples of `step_` from its centre, up to `reach_`
  DisparityPlane plane_;
  int samples_ = 0;
  std::vector<const float*> rows_;                   ///< of each sample, in the right image
  Eigen::Matrix<float, Eigen::Dynamic, 2> offsets_;  ///< du, dv of each sample
  Eigen::Matrix<float, Eigen::Dynamic, 5> model_;    ///< of each sample, in the order of the unknowns
  Eigen::VectorXf right_;
  float mean_grey_ = 0;
  double squared_residuals_ = 0;
  double right_energy_ = 0;  ///< about its mean
  double unit_variance_ = 0;
};

}  // namespace

RefinedDisparity refine_slanted(const cv::Mat1f& left, const cv::Mat1f& right, const cv::Mat1f& coarse,
                                const cv::Mat1b& radius, const cv::Mat1f& noise_variance, double smoothing_energy,
                                const SlantedRefinementParameters& parameters) {
  const cv::Mat1f fine_right = fine_rows(right);
  RefinedDisparity out;
  for (cv::Mat1f* image : {&out.disparity, &out.sigma, &out.correlation, &out.support})
    *image = cv::Mat1f(left.size(), NAN);
  double largest_radius = 0;
  cv::minMaxLoc(radius, nullptr, &largest_radius);

  tbb::parallel_for(0, left.rows, [&](int v) {
    Window window(left, fine_right, coarse, static_cast<int>(largest_radius), parameters);
    for (int u = 0; u < left.cols; ++u) {
      if (radius(v, u) == 0 || std::isnan(coarse(v, u)) || !window.place(u, v, radius(v, u))) continue;
      out.support(v, u) = window.support();
      if (!window.fit()) continue;
      const double white_noise =
          std::max(window.residual_variance() / smoothing_energy, static_cast<double>(noise_variance(v, u)));
      out.disparity(v, u) = window.disparity();
      out.sigma(v, u) = static_cast<float>(std::sqrt(white_noise * window.unit_variance()));
      out.correlation(v, u) = static_cast<float>(window.correlation());
    }
  });
  return out;
}

}  // namespace tankrig
