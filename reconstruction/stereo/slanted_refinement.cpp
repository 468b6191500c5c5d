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
constexpr double kConvergedPx = 0.01;  ///< the step after one of this size is a hundred times smaller
constexpr std::size_t kFewestSamples = 20;

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

using Normal = Eigen::Matrix<double, 5, 5>;
using Unknowns = Eigen::Matrix<double, 5, 1>;  ///< d, a, b, gain, offset

/// One pixel's window: gathered once from the left image, compared again and again with the right.
class Window {
 public:
  Window(const cv::Mat1f& left, const cv::Mat1f& fine_right, const cv::Mat1f& coarse,
         const SlantedRefinementParameters& parameters)
      : left_(left), fine_right_(fine_right), coarse_(coarse), parameters_(parameters) {
    samples_.reserve(static_cast<std::size_t>((2 * parameters.radius_px + 1) * (2 * parameters.radius_px + 1)));
  }

  /// Lays the first plane through the coarse disparities. False if too few of them lie on one plane to fit five
  /// unknowns.
  bool place(int u0, int v0) {
    u0_ = u0;
    v0_ = v0;
    plane_ = {coarse_(v0, u0), 0, 0};
    if (!fit_plane(2.0f)) return false;
    gather();
    return samples_.size() >= kFewestSamples;
  }

  bool fit() {
    gain_ = 1;
    offset_ = 0;
    for (int i = 0; i < parameters_.iterations; ++i) {
      if (!accumulate()) return false;
      const Unknowns step = normal_.ldlt().solve(gradient_);
      if (!step.allFinite()) return false;
      plane_.d += static_cast<float>(step[0]);
      plane_.a += static_cast<float>(step[1]);
      plane_.b += static_cast<float>(step[2]);
      gain_ += step[3];
      offset_ += step[4];
      if (std::abs(plane_.d - coarse_(v0_, u0_)) > kMaxDriftPx) return false;
      squared_residuals_ -= gradient_.dot(step);
      if (std::abs(step[0]) < kConvergedPx) return true;
    }
    return false;
  }

  float disparity() const { return plane_.d; }
  float support() const {
    const int side = 2 * parameters_.radius_px + 1;
    return static_cast<float>(samples_.size()) / static_cast<float>(side * side);
  }
  double correlation() const {
    return right_energy_ > 0 && gain_ > 0 ? std::sqrt(std::max(0.0, 1 - squared_residuals_ / right_energy_)) : 0.0;
  }
  double residual_variance() const {
    return std::max(0.0, squared_residuals_) / (static_cast<double>(samples_.size()) - 5);
  }
  /// Variance of d for unit noise variance.
  double unit_variance() const { return normal_.ldlt().solve(Unknowns::Unit(0))[0]; }

 private:
  struct Sample {
    float du, dv, grey;
  };

  bool fit_plane(float limit) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d y = Eigen::Vector3d::Zero();
    for_each_coarse(limit, [&](int du, int dv, float d) {
      const Eigen::Vector3d row(1, du, dv);
      A += row * row.transpose();
      y += row * static_cast<double>(d - plane_.d);
    });
    if (A(0, 0) < kFewestSamples) return false;
    const Eigen::Vector3d p = A.ldlt().solve(y);
    plane_.a = static_cast<float>(p[1]);
    plane_.b = static_cast<float>(p[2]);
    return p.allFinite();
  }

  void gather() {
    samples_.clear();
    mean_grey_ = 0;
    for_each_coarse(parameters_.same_surface_px, [&](int du, int dv, float) {
      const float grey = left_(v0_ + dv, u0_ + du);
      if (std::isnan(grey)) return;
      samples_.push_back({static_cast<float>(du), static_cast<float>(dv), grey});
      mean_grey_ += grey;
    });
    if (!samples_.empty()) mean_grey_ /= static_cast<float>(samples_.size());
    for (Sample& s : samples_) s.grey -= mean_grey_;
  }

  template <class Visit>
  void for_each_coarse(float limit, Visit visit) {
    const int r = parameters_.radius_px;
    const int v_end = std::min(v0_ + r, coarse_.rows - 1);
    const int u_end = std::min(u0_ + r, coarse_.cols - 1);
    for (int v = std::max(v0_ - r, 0); v <= v_end; ++v) {
      const float* row = coarse_[v];
      for (int u = std::max(u0_ - r, 0); u <= u_end; ++u) {
        const float expected =
            plane_.d + plane_.a * static_cast<float>(u - u0_) + plane_.b * static_cast<float>(v - v0_);
        if (std::abs(row[u] - expected) < limit) visit(u - u0_, v - v0_, row[u]);
      }
    }
  }

  /// Normal equations of the present plane.  False if the window leaves the right image.
  bool accumulate() {
    float s[20] = {};
    float e2 = 0, r2 = 0;
    for (const Sample& w : samples_) {
      const float x = (static_cast<float>(u0_) + w.du - plane_.d - plane_.a * w.du - plane_.b * w.dv) * kSubSteps;
      const int i = static_cast<int>(x);
      if (x < 0 || i + 1 >= fine_right_.cols) return false;
      const float* row = fine_right_[v0_ + static_cast<int>(w.dv)] + i;
      const float slope = row[1] - row[0];
      const float right = row[0] + (x - static_cast<float>(i)) * slope - mean_grey_;
      const float g = -slope * kSubSteps;  // d right / d disparity
      const float e = right - static_cast<float>(gain_) * w.grey - static_cast<float>(offset_);
      const float gu = g * w.du, gv = g * w.dv;
      s[0] += g * g;
      s[1] += g * gu;
      s[2] += g * gv;
      s[3] += g * w.grey;
      s[4] += g;
      s[5] += gu * gu;
      s[6] += gu * gv;
      s[7] += gu * w.grey;
      s[8] += gu;
      s[9] += gv * gv;
      s[10] += gv * w.grey;
      s[11] += gv;
      s[12] += w.grey * w.grey;
      s[13] += w.grey;
      s[14] += g * e;
      s[15] += gu * e;
      s[16] += gv * e;
      s[17] += w.grey * e;
      s[18] += e;
      s[19] += right;
      e2 += e * e;
      r2 += right * right;
    }
    if (std::isnan(e2)) return false;
    const auto n = static_cast<float>(samples_.size());
    normal_ << s[0], s[1], s[2], -s[3], -s[4],  //
        s[1], s[5], s[6], -s[7], -s[8],         //
        s[2], s[6], s[9], -s[10], -s[11],       //
        -s[3], -s[7], -s[10], s[12], s[13],     //
        -s[4], -s[8], -s[11], s[13], n;
    gradient_ << -s[14], -s[15], -s[16], s[17], s[18];
    squared_residuals_ = e2;
    right_energy_ = r2 - s[19] * s[19] / n;
    return true;
  }

  const cv::Mat1f& left_;
  const cv::Mat1f& fine_right_;
  const cv::Mat1f& coarse_;
  const SlantedRefinementParameters& parameters_;
  int u0_ = 0, v0_ = 0;
  DisparityPlane plane_;
  double gain_ = 1, offset_ = 0;
  std::vector<Sample> samples_;
  float mean_grey_ = 0;
  Normal normal_ = Normal::Zero();
  Unknowns gradient_ = Unknowns::Zero();
  double squared_residuals_ = 0;
  double right_energy_ = 0;  ///< about its mean
};

}  // namespace

RefinedDisparity refine_slanted(const cv::Mat1f& left, const cv::Mat1f& right, const cv::Mat1f& coarse,
                                const cv::Mat1f& noise_variance, double smoothing_energy,
                                const SlantedRefinementParameters& parameters) {
  const cv::Mat1f fine_right = fine_rows(right);
  RefinedDisparity out;
  for (cv::Mat1f* image : {&out.disparity, &out.sigma, &out.correlation, &out.support})
    *image = cv::Mat1f(left.size(), NAN);

  tbb::parallel_for(0, left.rows, [&](int v) {
    Window window(left, fine_right, coarse, parameters);
    for (int u = 0; u < left.cols; ++u) {
      if (std::isnan(coarse(v, u)) || !window.place(u, v)) continue;
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
