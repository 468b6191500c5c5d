#include "tests/stripe_table/stripe_peers.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace tankrig {
namespace {

int brightest(const cv::Mat1f& light, int x) {
  int top = 0;
  for (int y = 1; y < light.rows; ++y)
    if (light(y, x) > light(top, x)) top = y;
  return top;
}

}  // namespace

cv::Mat1f peer_light(const cv::Mat& image, const cv::Mat& background, int channel) {
  cv::Mat light;
  image.convertTo(light, CV_32F);
  if (!background.empty()) {
    cv::Mat dark;
    background.convertTo(dark, CV_32F);
    light -= dark;
  }
  if (image.channels() == 1) return light;
  cv::Mat1f planes[3];
  cv::split(light, planes);
  if (!background.empty()) return planes[0] + planes[1] + planes[2];
  return planes[channel] - 0.5 * (planes[(channel + 1) % 3] + planes[(channel + 2) % 3]);
}

std::vector<double> steger_ridge(const cv::Mat1f& light, double sigma, double threshold) {
  cv::Mat1f smooth, dx, dy, dxx, dyy, dxy;
  cv::GaussianBlur(light, smooth, {0, 0}, sigma);
  const cv::Matx13f first(-0.5f, 0, 0.5f), second(1, -2, 1);
  cv::filter2D(smooth, dx, CV_32F, first);
  cv::filter2D(smooth, dy, CV_32F, first.t());
  cv::filter2D(smooth, dxx, CV_32F, second);
  cv::filter2D(smooth, dyy, CV_32F, second.t());
  cv::filter2D(dx, dxy, CV_32F, first.t());
  std::vector<double> rows(light.cols, NAN);
  for (int x = 0; x < light.cols; ++x) {
    double strongest = 0;
    for (int y = 1; y + 1 < light.rows; ++y) {
      if (smooth(y, x) < threshold) continue;
      const double a = dxx(y, x), b = dxy(y, x), c = dyy(y, x);
      const double root = std::hypot(0.5 * (a - c), b), curvature = 0.5 * (a + c) - root;  // the more negative
      if (-curvature <= strongest) continue;
      double nx = b, ny = curvature - a;  // its direction
      if (std::hypot(nx, ny) < 1e-9) nx = a < c ? 1 : 0, ny = a < c ? 0 : 1;
      const double length = std::hypot(nx, ny);
      nx /= length, ny /= length;
      const double t = -(dx(y, x) * nx + dy(y, x) * ny) / curvature;
      if (std::abs(t * nx) > 0.6 || std::abs(t * ny) > 0.6) continue;
      // Along the ridge back to the middle of this column.
      const double slope = std::abs(ny) > 1e-6 ? -nx / ny : 0;
      strongest = -curvature;
      rows[x] = y + t * ny - slope * t * nx;
    }
  }
  return rows;
}

std::vector<double> log_parabola(const cv::Mat1f& light, double threshold) {
  std::vector<double> rows(light.cols, NAN);
  for (int x = 0; x < light.cols; ++x) {
    const int y = brightest(light, x);
    if (light(y, x) < threshold || y < 1 || y + 1 >= light.rows) continue;
    const auto log_at = [&](int row) { return std::log(std::max(1.0f, light(row, x))); };
    const double above = log_at(y - 1), here = log_at(y), below = log_at(y + 1), curvature = above - 2 * here + below;
    rows[x] = y + (curvature < 0 ? std::clamp(0.5 * (above - below) / curvature, -0.5, 0.5) : 0);
  }
  return rows;
}

std::vector<double> centre_of_mass(const cv::Mat1f& light, int half_window, double threshold) {
  std::vector<double> rows(light.cols, NAN);
  for (int x = 0; x < light.cols; ++x) {
    const int y = brightest(light, x);
    if (light(y, x) < threshold) continue;
    double mass = 0, moment = 0;
    for (int k = std::max(0, y - half_window); k <= std::min(light.rows - 1, y + half_window); ++k) {
      const double m = std::max(0.0f, light(k, x));
      mass += m, moment += m * k;
    }
    rows[x] = moment / mass;
  }
  return rows;
}

}  // namespace tankrig
