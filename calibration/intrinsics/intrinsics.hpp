// One camera's focal lengths, principal point and distortion, from pictures of a target held in many ways.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/estimate/estimate.hpp"
#include "calibration/intrinsics/board_bundle.hpp"

namespace tankrig {

/// A picture in which the target was found.
struct BoardPicture {
  std::string name;
  FoundBoard board;
};

struct IntrinsicsProblem {
  int width = 0, height = 0;
  BoardTarget target;
  std::vector<BoardPicture> pictures;
  std::optional<LensModel> lens;  ///< nothing: the simplest that fits
  std::optional<bool> bends;  ///< whether the target's bend is solved for; nothing: if it fits better, without a port
  /// A flat port of this thickness and these indices may be before the camera: tried too. Its distance and normal are
  /// where the search begins.
  std::optional<FlatPort> port = std::nullopt;
  std::optional<CameraModel> in_air = std::nullopt;  ///< the lens, calibrated in air: held behind the port
};

/// A lens model tried on the same pictures.
struct TriedModel {
  LensModel lens = LensModel::kK1;
  bool bends = false;
  bool port = false;
  int parameters = 0;        ///< of the camera and its port
  double rms = 0;            ///< of the pictures it was fitted to [px]
  double held_back_rms = 0;  ///< of pictures it was not fitted to [px]
  double excess = 0;         ///< mean square there, above that of the best model [px^2]
  double excess_sigma = 0;   ///< how well this is known, from how the pictures differ
};

/// What was done with a picture.
struct PictureFit {
  std::string name;
  std::size_t corners = 0;
  double rms = 0;         ///< [px]
  double distance = 0;    ///< of the target's middle [m]
  double tilt = 0;        ///< of the target against the picture [rad]
  bool left_out = false;  ///< it does not fit the others
};

/// Shares of the image's cells that have a corner.
struct ImageCoverage {
  static constexpr int kColumns = 8, kRows = 6;
  std::array<int, kColumns * kRows> corners{};  ///< per cell, row by row
  double share = 0;
};
ImageCoverage coverage_of(int width, int height, const std::vector<CornerResidual>& corners);

/// What one pixel of noise in the corners makes of all else: how much of the residuals is noise, and how much of it
/// neighbours have in common.
struct ResidualNoise {
  double sigma = 0;       ///< one axis of one corner: square root of sum r^2 / (2N - parameters) [px]
  double allowance = 1;   ///< factor on every sigma, because neighbouring corners err alike; 1 if they do not
  double systematic = 1;  ///< residuals over what changes from corner to corner: 1 for noise
  double degrees = 0;     ///< of freedom
};
ResidualNoise noise_of(const BoardBundle& bundle, const std::vector<CornerResidual>& residuals, int parameters);

struct IntrinsicsSolution {
  CameraModel camera;
  LensModel lens = LensModel::kPlumbBob;
  double rms = 0;  ///< per corner [px]
  ResidualNoise noise;
  std::vector<Estimate> estimates;  ///< of the camera's parameters, then of the target's bend
  std::vector<TriedModel> tried;    ///< simplest first; one, if the model was asked for
  std::string decision;             ///< the figure that decides, in words
  std::vector<PictureFit> pictures;
  std::vector<CornerResidual> left_out_corners;  ///< `view` counts the pictures
  std::vector<CornerResidual> residuals;         ///< `view` counts `bundle.views`
  ImageCoverage coverage;
  BoardBundle bundle;  ///< of the pictures in use
  BundleCovariance covariance;

  double mean_distance() const;
};

/// Threads: one. The same problem gives the same bits.
/// Errors: InputError with what is wrong or missing: fewer than 3 pictures, pictures that do not fit one camera, a focal
/// length that cannot be told because the target was never tilted.
IntrinsicsSolution solve(const IntrinsicsProblem& problem);

// Steps that a stereo pair shares.

/// `value` +- 95 %, from its variance at corners of 1 px. `moves`: how far one unit of it moves the target [m].
Estimate estimate(std::string name, std::string unit, double value, double variance, const ResidualNoise& noise,
                  double moves);
/// "px" of focal lengths and principal point, none of distortion.
std::string unit_of(std::size_t camera_parameter);
/// "m" of a port's distance, none of its normal.
std::string unit_of_port(std::size_t port_parameter);
/// Names parameters that the corners do not tell.
/// Errors: InputError if there are any, or if the focal length is not known to 2 %.
void check_observable(const BoardBundle& bundle, const BundleCovariance& covariance, const ResidualNoise& noise);
/// Angle between the target and the image plane [rad].
double tilt_of(const Transform& cMt);

}  // namespace tankrig
