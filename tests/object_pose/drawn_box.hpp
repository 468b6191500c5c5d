// The paper's black box on a grey floor, drawn ray by ray before tank-sim's left camera, with the truth known.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "calibration/object_pose/object_pose.hpp"

namespace tankrig::testing_support {

inline const Vector3d kBoxLow{-0.07, -0.15, -0.16}, kBoxHigh{0.07, 0.15, 0};

inline ObjectShape box_shape() {
  std::vector<Vector3d> v;
  for (int k = 0; k < 8; ++k)
    v.emplace_back(k & 1 ? kBoxHigh.x() : kBoxLow.x(), k & 2 ? kBoxHigh.y() : kBoxLow.y(),
                   k & 4 ? kBoxHigh.z() : kBoxLow.z());
  return {v,
          {{0, 2, 1},
           {1, 2, 3},
           {4, 5, 6},
           {5, 7, 6},
           {0, 1, 4},
           {1, 5, 4},
           {2, 6, 3},
           {3, 6, 7},
           {0, 4, 2},
           {2, 4, 6},
           {1, 3, 5},
           {3, 7, 5}}};
}

struct DrawnBox {
  unsigned seed = 1;
  double click_px = 1;    ///< standard deviation of a click's coordinate
  double grey_noise = 2;  ///< of a pixel, in levels
  double shadow = 0;      ///< width on the floor, beside the foot of the face across y that is seen [m]
  bool slanted = false;   ///< the shadow: it has no width at the foot's end in -x
  CameraModel camera{640, 480, 765.4, 762.9, 315.7, 236.8, -0.08, 0.02, 0.0005, -0.0005, 0};

  Transform cMo() const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> share(-1, 1);
    const Vector3d roll_pitch_yaw(from_degrees_(125 + 6 * share(random)), from_degrees_(6 * share(random)),
                                  from_degrees_(35 + 8 * share(random)));
    return make_transform_rpy({0.03 * share(random), 0.03 * share(random), 0.95 + 0.1 * share(random)}, roll_pitch_yaw);
  }

  ObjectPoseProblem problem() const {
    ObjectPoseProblem out{camera, {}, box_shape()};
    std::mt19937_64 random(1000 + seed);
    std::normal_distribution<double> noise(0, click_px);
    const Vector3d eye = cMo().inverse().translation();
    for (int k = 0; k < 8; ++k) {
      const Vector3d o(k & 1 ? kBoxHigh.x() : kBoxLow.x(), k & 2 ? kBoxHigh.y() : kBoxLow.y(),
                       k & 4 ? kBoxHigh.z() : kBoxLow.z());
      if (!out.shape.sees(eye, o)) continue;
      const std::string name = std::string(k & 1 ? "+x" : "-x") + (k & 2 ? "+y" : "-y") + (k & 4 ? "+z" : "-z");
      out.corners.push_back({name, o, *camera.project(cMo() * o) + Vector2d(noise(random), noise(random)), 1});
    }
    while (out.corners.size() > 6) out.corners.pop_back();  // the paper's six
    return out;
  }

  cv::Mat picture() const {
    constexpr int kRays = 4;
    const Transform oMc = cMo().inverse();
    std::mt19937_64 random(2000 + seed);
    std::normal_distribution<double> noise(0, grey_noise);
    cv::Mat grey(camera.height, camera.width, CV_8U);
    const auto corners = [&](int v) {  // of the pixels, between which rays are straight to 1e-4 px
      std::vector<Vector2d> rays;
      for (int u = 0; u <= camera.width; ++u) rays.push_back(camera.normalized(u - 0.5, v - 0.5));
      return rays;
    };
    std::vector<Vector2d> above, below = corners(0);
    for (int v = 0; v < camera.height; ++v) {
      above = std::move(below);
      below = corners(v + 1);
      for (int u = 0; u < camera.width; ++u) {
        double sum = 0;
        for (int i = 0; i < kRays * kRays; ++i) {
          const double x = (i % kRays + 0.5) / kRays, y = (i / kRays + 0.5) / kRays;
          const Vector2d ray =
              (1 - y) * ((1 - x) * above[u] + x * above[u + 1]) + y * ((1 - x) * below[u] + x * below[u + 1]);
          sum += brightness(oMc.translation(), oMc.linear() * ray.homogeneous());
        }
        grey.at<uchar>(v, u) = static_cast<uchar>(std::clamp(sum / (kRays * kRays) + noise(random), 0.0, 255.0));
      }
    }
    return grey;
  }

 private:
  static double from_degrees_(double degrees) { return degrees * 0.017453292519943295; }

  /// The faces of a black box differ by how the light falls on them.
  double brightness(const Vector3d& from, const Vector3d& along) const {
    double enter = 0, leave = 1e9;
    int axis = 0;
    for (int k = 0; k < 3; ++k) {
      const double a = (kBoxLow[k] - from[k]) / along[k], b = (kBoxHigh[k] - from[k]) / along[k];
      if (std::min(a, b) > enter) enter = std::min(a, b), axis = k;
      leave = std::min(leave, std::max(a, b));
    }
    constexpr double kFaces[] = {25, 38, 60};
    if (enter < leave) return kFaces[axis];
    const Vector3d floor = from + (kBoxLow.z() - from.z()) / along.z() * along;
    const double beside = from.y() > 0 ? floor.y() - kBoxHigh.y() : kBoxLow.y() - floor.y();
    const double share = slanted ? (floor.x() - kBoxLow.x()) / (kBoxHigh.x() - kBoxLow.x()) : 1;
    const bool shadowed = beside > 0 && beside < share * shadow && floor.x() > kBoxLow.x() && floor.x() < kBoxHigh.x();
    return shadowed ? kFaces[1] + 7 : 150;
  }
};

}  // namespace tankrig::testing_support
