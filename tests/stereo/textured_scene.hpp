// A pair of cameras before textured planes: images by ray casting, truth by geometry.
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/stereo/stereo_pair.hpp"

namespace tankrig::testing {

/// A rectangle in the left camera's frame c: centre, two orthogonal half sides [m].
struct TexturedRectangle {
  Vector3d centre;
  Vector3d half_u;
  Vector3d half_v;
  double contrast = 1.0;  ///< 0: one flat grey

  Vector3d normal() const { return half_u.cross(half_v).normalized(); }
};

struct TexturedScene {
  std::vector<TexturedRectangle> rectangles;
  double light = 1.0;  ///< 0: darkness

  /// Distance of p from the nearest rectangle [m].
  double distance(const Vector3d& p) const;
};

/// What the sensor adds.
struct SensorNoise {
  double sigma = 0;   ///< of full scale, additive Gaussian
  int particles = 0;  ///< bright discs at places of their own in each pair, at depths before the scene
  std::uint64_t seed = 1;
};

/// The laboratory's stereo camera: 765 and 776 px, 88.3 mm, distorted, turned against each other by a few mrad; a
/// window of `width` x `height` about the image centre.
StereoCalibration laboratory_pair(int width, int height);

/// Of 320 x 240 pixels.
inline const StereoCalibration& laboratory() {
  static const StereoCalibration calibration = laboratory_pair(320, 240);
  return calibration;
}

/// The noiseless images in grey levels, averaged over `supersampling`^2 rays per pixel.
struct CleanPair {
  cv::Mat1f left, right;
};
CleanPair render(const TexturedScene& scene, const StereoCalibration& calibration, int supersampling = 3);

/// `count` pairs of the scene at rest, each with noise of its own.
std::vector<StereoPair> record(const CleanPair& clean, const StereoCalibration& calibration, int count,
                               const SensorNoise& noise);

/// A plane through (0, 0, depth) that fills the view, turned by `turn_rad` about the image's y axis.
TexturedRectangle wall(double depth, double turn_rad);

/// The tank's box, 140 x 300 x 160 mm, three faces seen at 45 to 65 degrees, before a floor.
TexturedScene box_on_floor();

}  // namespace tankrig::testing
