#include "calibration/hand_eye/closed_forms.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <visp3/vision/vpHandEyeCalibration.h>

#include <Eigen/SVD>
#include <cstdio>
#include <iostream>
#include <opencv2/calib3d.hpp>

#include "calibration/visp/visp_conversion.hpp"
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

/// Transforms as OpenCV takes them, and back.
struct CvPoses {
  std::vector<cv::Mat> rotations, translations;

  void add(const Transform& aMb) {
    cv::Mat rotation(3, 3, CV_64F), translation(3, 1, CV_64F);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) rotation.at<double>(row, column) = aMb(row, column);
      translation.at<double>(row) = aMb(row, 3);
    }
    rotations.push_back(rotation);
    translations.push_back(translation);
  }
};

/// Errors: InputError if it is no rotation, or not finite.
Transform from_cv(const cv::Mat& rotation, const cv::Mat& translation) {
  vpHomogeneousMatrix out;
  for (int row = 0; row < 3; ++row) {
    const auto line = static_cast<unsigned>(row);
    for (int column = 0; column < 3; ++column)
      out[line][static_cast<unsigned>(column)] = rotation.at<double>(row, column);
    out[line][3] = translation.at<double>(row);
  }
  const Transform aMb = from_visp(out);
  if (!aMb.translation().allFinite()) throw InputError("the translation is not finite");
  return aMb;
}

/// Runs one method; whatever it throws is its failure.
template <class Solve>
ClosedForm tried(const char* name, const Solve& solve) {
  ClosedForm form{name, "", Transform::Identity(), Transform::Identity()};
  try {
    solve(form);
  } catch (const InputError& e) {
    form.failure = e.what();
  } catch (const cv::Exception& e) {
    form.failure = "OpenCV: " + std::string(e.err);
  } catch (const vpException& e) {
    form.failure = "ViSP: " + std::string(e.getMessage());
  }
  return form;
}

}  // namespace

Transform mean_of(const std::vector<Transform>& transforms) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Vector3d middle = Vector3d::Zero();
  for (const Transform& t : transforms) {
    sum += t.linear();
    middle += t.translation() / static_cast<double>(transforms.size());
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  Transform mean = Transform::Identity();
  mean.linear() = svd.matrixU() * Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  mean.translation() = middle;
  return mean;
}

std::vector<ClosedForm> closed_forms(const std::vector<Transform>& cMg, const std::vector<Transform>& bMe) {
  const auto mean_gripper = [&](ClosedForm& form) {
    std::vector<Transform> each;
    for (std::size_t i = 0; i < cMg.size(); ++i) each.push_back((form.cMb * bMe[i]).inverse() * cMg[i]);
    form.eMg = mean_of(each);
  };
  std::vector<ClosedForm> forms;
  // ViSP and OpenCV's first five solve for a camera in the gripper: with inverses, the camera in the base comes out.
  forms.push_back(tried("ViSP", [&](ClosedForm& form) {
    std::vector<vpHomogeneousMatrix> cMo, rMe;
    for (std::size_t i = 0; i < cMg.size(); ++i) {
      cMo.push_back(to_visp(cMg[i]));
      rMe.push_back(to_visp(bMe[i].inverse()));
    }
    vpHomogeneousMatrix bMc;
    const QuietOutput quiet;
    if (vpHandEyeCalibration::calibrate(cMo, rMe, bMc) != 0) throw InputError("ViSP: it gave up");
    form.cMb = from_visp(bMc).inverse();
    mean_gripper(form);
  }));
  CvPoses markers, arms, arms_inverse;
  for (std::size_t i = 0; i < cMg.size(); ++i) {
    markers.add(cMg[i]);
    arms.add(bMe[i]);
    arms_inverse.add(bMe[i].inverse());
  }
  using Pair = std::pair<const char*, cv::HandEyeCalibrationMethod>;
  for (const auto& [name, method] :
       {Pair{"Tsai", cv::CALIB_HAND_EYE_TSAI}, Pair{"Park", cv::CALIB_HAND_EYE_PARK},
        Pair{"Horaud", cv::CALIB_HAND_EYE_HORAUD}, Pair{"Andreff", cv::CALIB_HAND_EYE_ANDREFF},
        Pair{"Daniilidis", cv::CALIB_HAND_EYE_DANIILIDIS}})
    forms.push_back(tried(name, [&, method = method](ClosedForm& form) {
      cv::Mat rotation, translation;
      cv::calibrateHandEye(arms_inverse.rotations, arms_inverse.translations, markers.rotations, markers.translations,
                           rotation, translation, method);
      form.cMb = from_cv(rotation, translation).inverse();
      mean_gripper(form);
    }));
  // cMg * gMe = cMb * bMe: OpenCV's world is the marker, its base the end effector, its gripper the arm's base.
  using RobotWorld = std::pair<const char*, cv::RobotWorldHandEyeCalibrationMethod>;
  for (const auto& [name, method] :
       {RobotWorld{"Shah", cv::CALIB_ROBOT_WORLD_HAND_EYE_SHAH}, RobotWorld{"Li", cv::CALIB_ROBOT_WORLD_HAND_EYE_LI}})
    forms.push_back(tried(name, [&, method = method](ClosedForm& form) {
      cv::Mat gMe_rotation, gMe_translation, rotation, translation;
      cv::calibrateRobotWorldHandEye(markers.rotations, markers.translations, arms.rotations, arms.translations,
                                     gMe_rotation, gMe_translation, rotation, translation, method);
      form.cMb = from_cv(rotation, translation);
      form.eMg = from_cv(gMe_rotation, gMe_translation).inverse();
    }));
  return forms;
}

}  // namespace tankrig
