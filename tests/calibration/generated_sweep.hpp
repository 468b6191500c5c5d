// A sweep there and back over a floor with a box on it, with known times: stripes by geometry alone, no pictures.
#pragma once

#include <cmath>
#include <optional>
#include <random>

#include "calibration/time_offset/time_offset.hpp"

namespace tankrig::testing_support {

/// The rig is the default one's; only every `line_step`-th image column is searched.
struct GeneratedSweep {
  double offset = 0;      ///< t_camera - t_joints [s]
  double velocity = 0.1;  ///< of the elbow [rad/s]
  double backlash = 0;    ///< between encoder and link, total [rad]
  double noise_px = 0.1;  ///< of a stripe point
  bool ticks = true;      ///< encoders count whole ticks
  double from = 1.55, to = 1.85;
  int line_step = 24;
  unsigned seed = 1;

  static constexpr double kRest = 0.6, kFrame = 0.04, kSample = 0.01, kFloor = 1.18, kTop = 1.02;

  TimeOffsetProblem problem() const {
    TimeOffsetProblem p;
    p.camera = {720, 576, 626.08, 682.78, 368.93, 284.83};
    p.cMb = make_transform({0.716, 0.228, 0.585}, {0.418637960, -0.308630971, -0.569861946, 0.636196939}).inverse();
    p.arm = arm5e();
    p.ePl = {{1, 0, 0}, 0.09796};
    p.recordings = {recording(p)};
    return p;
  }

  TimeOffsetRecording recording(const TimeOffsetProblem& p) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> gauss;
    const double phase = std::uniform_real_distribution<double>(0, kFrame)(random);
    const double sampled = std::uniform_real_distribution<double>(0, kSample)(random);
    TimeOffsetRecording r;
    for (double t = sampled; t < 2 * (kRest + duration()) + kRest; t += kSample)
      r.joints.push_back({Stamp{} + from_seconds(t), measured(p.arm, t)});
    for (int pass = 0; pass < 2; ++pass) {
      const double begin = kRest + pass * (kRest + duration());
      for (double t = begin + 0.1 + phase; t < begin + duration() - 0.1; t += kFrame) {
        TimedStripe s{Stamp{} + from_seconds(t + offset), pass, {}};
        const Plane cPl = (p.cMb * p.arm.bMe(joints(angle(t)))) * p.ePl;
        for (int line = 0; line < p.camera.width; line += line_step)
          if (const auto v = stripe(p, cPl, line)) s.points.push_back({line, *v + noise_px * gauss(random), noise_px});
        r.stripes.push_back(s);
      }
    }
    return r;
  }

 private:
  double duration() const { return std::abs(to - from) / velocity; }

  /// Of the link, at the joints' time.
  double angle(double t) const {
    const double there = std::clamp(t - kRest, 0.0, duration());
    const double back = std::clamp(t - 2 * kRest - duration(), 0.0, duration());
    return from + velocity * (there - back);
  }
  static JointVector joints(double elbow) { return (JointVector() << 0, 0.13, elbow, 0, 0.1).finished(); }

  JointVector measured(const ArmModel& arm, double t) const {
    const bool forward = t < kRest + duration() + 0.5 * kRest;
    double q = angle(t) + (forward ? 0.5 : -0.5) * backlash;
    const Actuator& axis = arm.actuators[kElbow];
    if (ticks) q = axis.angle(std::round(axis.ticks(q)));
    return joints(q);
  }

  /// Range to the floor or to the box's top, whichever is nearer, on a ray of the camera.
  static double depth(const Transform& bMc, const Vector3d& x) {
    const Vector3d d = bMc.linear() * x, o = bMc.translation();
    const double top = (kTop - o.z()) / d.z();
    const Vector3d hit = o + top * d;
    if (hit.x() > -0.40 && hit.x() < -0.12 && hit.y() > -0.05 && hit.y() < 0.15) return top;
    return (kFloor - o.z()) / d.z();
  }

  static std::optional<double> stripe(const TimeOffsetProblem& p, const Plane& cPl, int line) {
    const Transform bMc = p.cMb.inverse();
    const auto off = [&](double v) {
      const Vector3d x = p.camera.normalized(line, v).homogeneous();
      return cPl.distance(depth(bMc, x) * x);
    };
    constexpr double kStep = 16;
    for (double v = 0; v + kStep < p.camera.height; v += kStep) {
      double low = v, high = v + kStep;
      if (off(low) * off(high) > 0) continue;
      for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        (off(low) * off(middle) <= 0 ? high : low) = middle;
      }
      if (std::abs(off(low)) < 1e-6) return low;  // else it jumps from one surface to the other
    }
    return std::nullopt;
  }
};

}  // namespace tankrig::testing_support
