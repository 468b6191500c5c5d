// What each uncertainty of a rig costs in millimetres on its target, and so what to improve first.
//
// A place on the target is measured as the rig would: the ray of its pixel meets the laser's sheet, or both eyes' rays meet. Then
// one freedom is changed by its sigma, everything seen stays as it is, and the place moves. What counts is how far it leaves the
// surface, along the surface's normal.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/arm_model.hpp"
#include "core/calibration_file.hpp"
#include "core/camera_model.hpp"

namespace tankrig {

struct BudgetCamera {
  std::string name;
  CameraModel model;
  Transform bMc = Transform::Identity();
};

/// Everything that turns what is seen into places.
/// Frames: b.
struct MeasuringRig {
  BudgetCamera mono;
  std::optional<BudgetCamera> left, right;
  ArmModel arm;
  Plane ePl;
};

struct BudgetTarget {
  Vector3d p = Vector3d::Zero(), normal = Vector3d::UnitZ();  ///< in b; normal out of the surface, unit
};

struct BudgetSweep {
  JointVector posture = JointVector::Zero();
  double from = 0, to = 0, velocity = 0;  ///< of the elbow [rad, rad/s]
};

/// One freedom, and what a change of it does to the rig and to the joints it believes in.
struct Freedom {
  double sigma = 0;
  std::function<void(MeasuringRig& rig, JointVector& q, double amount)> change;
};

struct Uncertainty {
  std::string name;       ///< "mono: position"
  std::string sigma;      ///< in words: "10 mm"
  bool measured = false;  ///< from a calibration; else assumed
  std::vector<Freedom> freedoms;
};

/// Of all freedoms that a calibration is about, with its sigmas, or assumed ones of a rig built by its drawings. `tick`: of the
/// encoders, by joint [rad].
std::vector<Uncertainty> uncertainties_of(const MeasuringRig& rig, const Calibration* calibration,
                                          const BudgetSweep& sweep, const std::array<double, kJoints>& tick);

/// What `nominal` has differently from the measured rig, as freedoms of which one whole sigma is the difference. A time offset
/// that nominal values do not take off comes with it [s].
std::vector<Uncertainty> differences_of(const MeasuringRig& measured, const MeasuringRig& nominal, double time_offset,
                                        const BudgetSweep& sweep);

struct BudgetLine {
  std::string name, sigma;
  bool measured = false;
  std::optional<double> laser, stereo;  ///< root mean square over the target [m]; nothing where it has no part

  double worst() const { return std::max(laser.value_or(0), stereo.value_or(0)); }
};

struct Budget {
  std::vector<BudgetLine> lines;                      ///< the costliest first
  double laser = 0, stereo = 0;                       ///< all together [m]
  std::size_t laser_targets = 0, stereo_targets = 0;  ///< that the method sees
};

/// Errors: InputError if neither method sees anything of the target.
Budget error_budget(const MeasuringRig& rig, const BudgetSweep& sweep, const std::vector<BudgetTarget>& targets,
                    const std::vector<Uncertainty>& uncertainties);

/// How far places come to lie off the surface, along its normals [m]; of those that the method sees.
struct Misplaced {
  double mean = 0, rms = 0;
  std::size_t places = 0;
};
struct Misplacement {
  Misplaced laser, stereo;
};

/// What is made of all that `rig` sees of its targets by somebody who believes it to be `believed`. `bMbelieved`: where its
/// arm base is believed to be.
Misplacement misplacement(const MeasuringRig& rig, const MeasuringRig& believed, const Transform& bMbelieved,
                          const BudgetSweep& sweep, const std::vector<BudgetTarget>& targets);

}  // namespace tankrig
