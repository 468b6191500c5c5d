// Hand-eye sets whose truth is known: the ARM5E holds a marker before tank-sim's mono camera.
#pragma once

#include <random>

#include "calibration/hand_eye/hand_eye.hpp"
#include "core/angles.hpp"

namespace tankrig::testing_support {

/// The arm whose zeros are that far beyond those of its drawing [rad].
inline ArmModel arm5e_off_by(double shoulder_zero, double elbow_zero) {
  ArmModel arm = arm5e();
  arm.dh[1].theta0 += shoulder_zero;
  arm.dh[2].theta0 += elbow_zero;
  return arm;
}

struct GeneratedPostures {
  unsigned seed = 1;
  std::size_t views = 20;
  double corner_px = 0.2;                    ///< standard deviation of a corner's coordinate
  double joint_rad = 0;                      ///< of where a joint stands from what its encoder reads
  double shoulder_zero = 0, elbow_zero = 0;  ///< what the arm's true zeros are beyond those it is given with

  CameraModel camera{720, 576, 626.08, 682.78, 368.93, 284.83, -0.370, 0.174, -0.0016, 0.0029, 0};
  Transform cMb =
      make_transform({0.716, 0.228, 0.585}, {0.418637960, -0.308630971, -0.569861946, 0.636196939}).inverse();
  Transform eMg = make_transform_rpy({0.03, 0.01, -0.06}, {0.1, from_degrees(70), 0.2});
  double size = 0.06;

  ArmModel true_arm() const { return arm5e_off_by(shoulder_zero, elbow_zero); }

  HandEyeProblem problem() const {
    HandEyeProblem out;
    out.camera = camera;
    out.arm = arm5e();
    const double h = size / 2;
    const std::vector<Vector3d> marker = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
    out.target_c = {0, 0, 1.1};
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, 1);
    const auto within = [&](double middle, double span) {
      return middle + span * (std::uniform_real_distribution<double>(0, 1)(random) - 0.5);
    };
    const ArmModel arm = true_arm();
    while (out.views.size() < views) {
      JointVector q = JointVector::Zero();
      q << within(0, 0.9), within(0.4, 0.6), within(1.4, 1.4), within(0, 6.2), 0;
      JointVector stands = q;
      for (int i = 0; i < 4; ++i) stands[i] += joint_rad * normal(random);
      HandEyeView view;
      view.name = "view " + std::to_string(out.views.size());
      view.q = q;
      view.points = marker;
      view.cMg = cMb * arm.bMe(stands) * eMg;
      const Vector3d to_camera = -view.cMg.translation().normalized();
      if (view.cMg.linear().col(2).dot(to_camera) < 0.4) continue;
      bool seen = true;
      for (const Vector3d& p : marker) {
        const auto pixel = camera.project(view.cMg * p);
        seen = seen && pixel && camera.contains(*pixel);
        if (seen) view.corners.push_back(*pixel + corner_px * Vector2d(normal(random), normal(random)));
      }
      if (seen) out.views.push_back(view);
    }
    return out;
  }
};

}  // namespace tankrig::testing_support
