// Cameras, where a target was held, and how it is bent, so that they fit the corners seen best.
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/boards/find_board.hpp"
#include "core/camera_model.hpp"
#include "core/enum_names.hpp"

namespace tankrig {

/// Which distortion is solved for; the simpler comes first.
enum class LensModel : std::uint8_t { kK1, kK1K2, kK1K2P1P2, kPlumbBob, kRational };
template <>
inline constexpr std::array kNames<LensModel>{"k1", "k1k2", "k1k2p1p2", "plumb-bob", "rational"};
inline constexpr LensModel kLensModels[] = {LensModel::kK1, LensModel::kK1K2, LensModel::kK1K2P1P2,
                                            LensModel::kPlumbBob, LensModel::kRational};

/// fx, fy, cx, cy, and OpenCV's k1, k2, p1, p2, k3, k4, k5, k6.
inline constexpr int kCameraParameters = 12;
using CameraParameters = std::array<double, kCameraParameters>;
inline constexpr std::array<const char*, kCameraParameters> kCameraParameterNames{"fx", "fy", "cx", "cy", "k1", "k2",
                                                                                  "p1", "p2", "k3", "k4", "k5", "k6"};
/// A camera with a rational distortion, too: tried here, though the rig's camera model has no place for it.
struct RationalCamera : CameraModel {
  double k4 = 0, k5 = 0, k6 = 0;  ///< OpenCV's: the radial polynomial of k1, k2, k3 is divided by theirs
};
CameraParameters parameters_of(const RationalCamera& camera);
/// The camera with the size and the port of `like` and these parameters.
RationalCamera camera_of(const CameraModel& like, const CameraParameters& parameters);
std::vector<int> free_parameters(LensModel lens);

/// Of a port: its distance [m], and its normal's x and y over z.
inline constexpr int kPortParameters = 3;
using PortParameters = std::array<double, kPortParameters>;
inline constexpr std::array<const char*, kPortParameters> kPortParameterNames{"port distance", "port normal x",
                                                                              "port normal y"};
PortParameters parameters_of(const FlatPort& port);
FlatPort port_of(const FlatPort& like, const PortParameters& parameters);

/// One moment: a target held still, seen by every camera.
struct BoardView {
  std::string name;
  std::vector<FoundBoard> seen;  ///< one per camera
};

/// Frames: camera 0 is c; kMc[k] maps c to camera k.
/// Units: metres, pixels.
struct BoardBundle {
  BoardTarget target;
  LensModel lens = LensModel::kPlumbBob;
  bool lens_held = false;  ///< the cameras' parameters stay; their ports are solved for where they have one
  bool bends = false;
  std::vector<BoardView> views;
  std::vector<RationalCamera> cameras;  ///< these and what follows: first guess, then solution
  std::vector<Transform> kMc;
  std::vector<Transform> cMt;        ///< per view
  Vector2d bend = Vector2d::Zero();  ///< how far the target's middle stands out, from its bend along x and along y

  /// The target's points, bent.
  std::vector<Vector3d> points() const;
};

struct CornerResidual {
  int camera = 0;
  std::size_t view = 0;
  int id = 0;
  Vector2d pixel = Vector2d::Zero(), error = Vector2d::Zero();  ///< `error`: projected minus seen [px]
};

/// Where the parameters stand in a covariance.
struct BundleLayout {
  std::vector<std::array<int, kCameraParameters>> cameras;  ///< -1: not solved for
  std::vector<int> ports;                                   ///< first of three; -1: no port
  std::vector<int> relative;                                ///< first of six of kMc[k]: rotation vector, translation
  int bend = -1;                                            ///< first of two
  std::vector<int> views;                                   ///< first of six of cMt
  int size = 0;
};

struct BundleFit {
  std::vector<CornerResidual> residuals;
  bool converged = false;
};

/// Improves `bundle` by Ceres. `cauchy_px` is the scale of a loss that bears outliers; 0: least squares.
/// Threads: one, so that the same corners give the same bits.
BundleFit solve(BoardBundle& bundle, double cauchy_px = 0);

/// For corners with an error of 1 px in x and in y, independent of each other.
struct BundleCovariance {
  BundleLayout layout;
  Eigen::MatrixXd matrix;
  std::vector<std::string> unobservable;  ///< parameters that the corners do not tell; then there is no matrix
};
BundleCovariance covariance(const BoardBundle& bundle);

/// A target's place in a camera that is known, and what is left [px]. Nothing if it cannot be seen from any place.
struct BoardPose {
  Transform cMt;
  double rms = 0;  ///< per corner
};
std::optional<BoardPose> board_pose(const RationalCamera& camera, const std::vector<Vector3d>& points,
                                    const FoundBoard& board);

/// A camera of unknown focal lengths, and where the boards were held.
/// Errors: InputError if no focal length fits.
CameraModel first_camera(int width, int height, const BoardTarget& target, const std::vector<FoundBoard>& boards);

/// Root mean square of the errors' lengths, as cv::calibrateCamera has it.
double rms(const std::vector<CornerResidual>& residuals);

}  // namespace tankrig
