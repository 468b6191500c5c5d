// The module tankrig_visp.so: ViSP's hand-eye, poses, dots and AprilTags.
#include <fcntl.h>
#include <unistd.h>
#include <visp3/blob/vpDot2.h>
#include <visp3/detection/vpDetectorAprilTag.h>
#include <visp3/vision/vpHandEyeCalibration.h>
#include <visp3/vision/vpPose.h>

#include <cstdio>
#include <iostream>

#include "calibration/visp/module/visp_conversion.hpp"
#include "calibration/visp/module/visp_image.hpp"
#include "calibration/visp/visp_methods.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

/// vpHandEyeCalibration prints a page by printf and std::cout, and has no switch: while this lives, standard output goes nowhere.
class QuietOutput {
 public:
  QuietOutput() {
    std::fflush(stdout);
    std::cout.flush();
    kept_ = ::dup(STDOUT_FILENO);
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (kept_ >= 0 && nowhere >= 0) ::dup2(nowhere, STDOUT_FILENO);
    if (nowhere >= 0) ::close(nowhere);
  }
  ~QuietOutput() {
    std::fflush(stdout);
    std::cout.flush();
    if (kept_ < 0) return;
    ::dup2(kept_, STDOUT_FILENO);
    ::close(kept_);
  }
  QuietOutput(const QuietOutput&) = delete;
  QuietOutput& operator=(const QuietOutput&) = delete;

 private:
  int kept_;
};

/// Runs one method; whatever it throws is its failure.
template <class Solve>
VispPose tried(const char* name, const Solve& solve) {
  VispPose found{name, "", Transform::Identity()};
  try {
    found.pose = from_visp(solve());
    if (!found.pose.translation().allFinite()) throw InputError("its answer is not finite");
  } catch (const vpException& e) {
    found.failure = "ViSP: " + std::string(e.getMessage());
  } catch (const InputError& e) {
    found.failure = e.what();
  }
  return found;
}

VispPose hand_eye(const std::vector<Transform>& cMo, const std::vector<Transform>& rMe) {
  return tried("ViSP", [&] {
    std::vector<vpHomogeneousMatrix> seen, arm;
    for (std::size_t i = 0; i < cMo.size(); ++i) {
      seen.push_back(to_visp(cMo[i]));
      arm.push_back(to_visp(rMe[i]));
    }
    vpHomogeneousMatrix eMc;
    const QuietOutput quiet;
    if (vpHandEyeCalibration::calibrate(seen, arm, eMc) != 0) throw InputError("ViSP: it gave up");
    return eMc;
  });
}

std::vector<VispPose> poses(const std::vector<Vector3d>& points, const std::vector<Vector2d>& rays, double inlier,
                            const Transform& start) {
  vpPose pose;
  for (std::size_t k = 0; k < points.size(); ++k) {
    vpPoint point(points[k].x(), points[k].y(), points[k].z());
    point.set_x(rays[k].x());
    point.set_y(rays[k].y());
    pose.addPoint(point);
  }
  pose.setRansacNbInliersToReachConsensus(static_cast<unsigned>(points.size()));
  pose.setRansacThreshold(inlier);
  const std::pair<const char*, vpPose::vpPoseMethodType> methods[] = {
      {"LAGRANGE", vpPose::LAGRANGE},
      {"DEMENTHON", vpPose::DEMENTHON},
      {"LOWE", vpPose::LOWE},
      {"RANSAC", vpPose::RANSAC},
      {"LAGRANGE_LOWE", vpPose::LAGRANGE_LOWE},
      {"DEMENTHON_LOWE", vpPose::DEMENTHON_LOWE},
      {"VIRTUAL_VS", vpPose::VIRTUAL_VS},
      {"DEMENTHON_VIRTUAL_VS", vpPose::DEMENTHON_VIRTUAL_VS},
      {"LAGRANGE_VIRTUAL_VS", vpPose::LAGRANGE_VIRTUAL_VS}};
  std::vector<VispPose> found;
  for (const auto& [name, method] : methods)
    found.push_back(tried(name, [&, method = method] {
      vpHomogeneousMatrix cMo = to_visp(start);
      if (!pose.computePose(method, cMo)) throw InputError("ViSP found no consensus");
      return cMo;
    }));
  return found;
}

std::vector<Vector2d> dots(const cv::Mat& grey, const std::vector<cv::Point>& inside) {
  const vpImage<unsigned char> image = to_visp(grey);
  std::vector<Vector2d> centres;
  for (const cv::Point& p : inside) {
    vpDot2 dot;
    dot.setGraphics(false);
    try {
      dot.initTracking(image, vpImagePoint(p.y, p.x));
    } catch (const vpException&) {
      continue;  // ViSP finds no dot there: it is none
    }
    centres.emplace_back(dot.getCog().get_u(), dot.getCog().get_v());
  }
  return centres;
}

std::vector<VispTag> tags(const cv::Mat& grey, AprilTagFamily family) {
  vpDetectorAprilTag detector(family == AprilTagFamily::k16h5   ? vpDetectorAprilTag::TAG_16h5
                              : family == AprilTagFamily::k25h9 ? vpDetectorAprilTag::TAG_25h9
                                                                : vpDetectorAprilTag::TAG_36h11);
  detector.detect(to_visp(grey));
  const auto ids = detector.getTagsId();
  const auto corners = detector.getTagsCorners();
  std::vector<VispTag> found(ids.size());
  for (std::size_t k = 0; k < ids.size(); ++k) {
    found[k].id = ids[k];
    for (std::size_t c = 0; c < 4; ++c) found[k].corners[c] = {corners[k][c].get_u(), corners[k][c].get_v()};
  }
  return found;
}

}  // namespace
}  // namespace tankrig

extern "C" {
extern const tankrig::VispMethods tankrig_visp;
const tankrig::VispMethods tankrig_visp{tankrig::hand_eye, tankrig::poses, tankrig::dots, tankrig::tags};
}
