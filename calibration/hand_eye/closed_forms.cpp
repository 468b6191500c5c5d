#include "calibration/hand_eye/closed_forms.hpp"

#include <fmt/core.h>

#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>

#include "calibration/visp/visp_methods.hpp"
#include "core/input_error.hpp"

namespace tankrig {
namespace {

/// The rotation nearest to `matrix`.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

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

/// Errors: InputError if it is no rotation within 1e-3, or not finite.
Transform from_cv(const cv::Mat& rotation, const cv::Mat& translation) {
  Eigen::Matrix3d given;
  Transform aMb = Transform::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) given(row, column) = rotation.at<double>(row, column);
    aMb.translation()[row] = translation.at<double>(row);
  }
  if (!aMb.translation().allFinite()) throw InputError("the translation is not finite");
  aMb.linear() = nearest_rotation(given);
  if (const double off = (given - aMb.linear()).norm(); !(off < 1e-3))
    throw InputError(fmt::format("the matrix is {} from a rotation, expected one within 0.001", off));
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
  Transform mean = Transform::Identity();
  mean.linear() = nearest_rotation(sum);
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
  std::vector<Transform> eMb;
  for (const Transform& pose : bMe) eMb.push_back(pose.inverse());
  const VispPose by_visp = visp().hand_eye(cMg, eMb);
  ClosedForm& visp_form =
      forms.emplace_back(ClosedForm{by_visp.name, by_visp.failure, Transform::Identity(), Transform::Identity()});
  if (by_visp.failure.empty()) {
    visp_form.cMb = by_visp.pose.inverse();
    mean_gripper(visp_form);
  }
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
