// Stripe images whose truth is known.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <random>

#include "core/frames.hpp"

namespace tankrig {

struct GeneratedStripe {
  int width = 240, height = 200;
  double peak = 180;  ///< of the strongest channel [DN]
  double sd = 1.5;    ///< of the profile [px]
  Eigen::Vector3d bgr{0.1, 1.0, 0.2};
  double noise = 0;    ///< sd [DN], every channel
  double speckle = 0;  ///< contrast: sd of the factor on the light of each pixel, the same for its channels
  unsigned seed = 1;
  std::function<double(double)> haze;  ///< beside the core at `t` px from its middle, over the peak; none: 0
  std::function<double(int)> row;      ///< true row at a column; not finite: no stripe there
  std::function<double(int, int)> scene = [](int, int) { return 8.0; };  ///< grey value at (x, y) without laser [DN]
  std::function<double(int, int)> reflectance;                           ///< at (x, y), to the laser; none: 1
  bool laser = true;

  double true_row(int column) const { return row ? row(column) : 0.4 * height + 0.137 * column; }

  cv::Mat image() const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    cv::Mat out(height, width, CV_8UC3);
    for (int x = 0; x < width; ++x) {
      const double centre = true_row(x);
      for (int y = 0; y < height; ++y) {
        const double t = (y - centre) / sd;
        const double factor = speckle > 0 ? std::max(0.0, 1 + speckle * normal(random)) : 1;
        const double share = factor * (reflectance ? reflectance(x, y) : 1);
        const double profile = std::exp(-0.5 * t * t) + (haze ? haze(y - centre) : 0);
        const double light = laser && std::isfinite(centre) ? share * peak * profile : 0;
        for (int c = 0; c < 3; ++c)
          out.at<cv::Vec3b>(y, x)[c] =
              cv::saturate_cast<std::uint8_t>(scene(x, y) + light * bgr[c] + noise * normal(random));
      }
    }
    return out;
  }
};

}  // namespace tankrig
