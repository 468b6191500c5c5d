#include "apps/tankrig/calibrate/calibration_part.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "calibration/estimate/rotation_vector.hpp"
#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "core/lens_numbers.hpp"
#include "core/shown_text.hpp"
#include "core/utc.hpp"
#include "session/checking/sha256.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

RigConfig rig_of(const WriteOptions& options) {
  if (options.rig.empty()) throw InputError("--write: expected --rig RIG beside it: whose calibration this is");
  const fs::path rig = find_rig(options.rig);
  if (fs::exists(options.file)) return load_rig(rig, "", options.file);
  return options.drawn ? load_drawn_rig(rig) : load_rig(rig);
}

}  // namespace

void add_write_options(CLI::App* command, WriteOptions& options) {
  command->add_option("--write", options.file,
                      "Put the result into this calibration.yaml of the rig; other parts stay");
  if (!command->get_option_no_throw("--rig"))
    command->add_option("--rig", options.rig, "Whose calibration: a rig in etc/rigs, or a rig file");
}

CalibrationPart::CalibrationPart(const WriteOptions& options) : file_(options.file), rig_(rig_of(options)) {
  const std::string basis = calibration_basis_sha256(rig_);
  if (fs::exists(file_)) {
    values = rig_.calibration->values;
    if (values.rig != rig_.name)
      throw InputError(file_, "rig: found " + shown_text(values.rig) + ", expected a calibration of " + rig_.name);
    if (values.rig_sha256 != basis)
      throw InputError(
          file_, "rig_sha256: was made when arm or cameras of " + rig_.name + " were others, expected a new file");
  }
  values.rig = rig_.name;
  values.rig_sha256 = basis;
}

const RigCamera& CalibrationPart::camera(const std::string& name) const {
  std::string names;
  for (const RigCamera& camera : rig_.cameras) {
    if (camera.name == name) return camera;
    names += (names.empty() ? "" : ", ") + camera.name;
  }
  throw InputError(rig_.file, "has no camera " + shown_text(name) + ", expected one of " + names);
}

const RigCamera& CalibrationPart::camera(const std::string& name, int width, int height) const {
  const RigCamera& found = camera(name);
  if (found.model.width != width || found.model.height != height)
    throw InputError(fmt::format("found pictures of {} x {} px, expected the {} x {} px of the rig's camera {}", width,
                                 height, found.model.width, found.model.height, name));
  return found;
}

const RigCamera& CalibrationPart::camera(CameraRole role) const {
  const RigCamera* const camera = rig_.find_camera(role);
  if (!camera) throw InputError(rig_.file, fmt::format("has no camera of the role {}", name_of(role)));
  return *camera;
}

CalibrationSource CalibrationPart::source(const std::string& method, const fs::path& data,
                                          std::vector<fs::path> files) {
  std::sort(files.begin(), files.end());
  std::string sums;
  for (const fs::path& file : files)
    sums += sha256_of_file(file) + "  " + file.lexically_relative(data).string() + "\n";
  return {method, utc_now(), data.string(), sha256_of_text(sums)};
}

void CalibrationPart::write(std::vector<CalibrationCheck> checks) {
  values.made_utc = utc_now();
  values.software = TANKRIG_VERSION;
  values.verdict = checks.empty()       ? CalibrationVerdict::kUnchecked
                   : all_passed(checks) ? CalibrationVerdict::kAccepted
                                        : CalibrationVerdict::kRejected;
  values.checks = std::move(checks);
  const std::string text = calibration_text(values);
  parse_calibration(text, file_);  // what a scan would refuse is not written
  write_file_durably(file_, text);
}

CalibratedLens calibrated_lens(const CameraModel& model, const std::vector<Estimate>& estimates, double rms_px,
                               std::size_t views, const CalibrationSource& source) {
  CalibratedLens lens{source, model, {}, rms_px, static_cast<int>(views)};
  const auto sigma = [&](const char* name) {
    const auto found =
        std::find_if(estimates.begin(), estimates.end(), [name](const Estimate& e) { return e.name == name; });
    return found == estimates.end() ? 0 : found->sigma;
  };
  for (std::size_t i = 0; i < kLensNumbers.size(); ++i) lens.sigma.push_back(sigma(kCameraParameterNames[i]));
  if (model.port)
    for (const char* name : kPortParameterNames) lens.sigma.push_back(sigma(name));
  return lens;
}

CalibratedPose calibrated_pose(const Transform& aMb, const Eigen::Matrix<double, 6, 6>& covariance) {
  const Eigen::Matrix<double, 6, 1> sigma = covariance.diagonal().cwiseSqrt();
  return {aMb, sigma.tail<3>(), sigma.head<3>()};
}

CalibratedPose calibrated_inverse(const Transform& aMb, const Eigen::Matrix<double, 6, 6>& covariance) {
  // Where aMb turns by r and moves by d, bMa turns by -bRa r and moves by bRa (r x t - d).
  const Eigen::Matrix3d bRa = aMb.linear().transpose();
  Eigen::Matrix<double, 6, 6> by = Eigen::Matrix<double, 6, 6>::Zero();
  by.topLeftCorner<3, 3>() = -bRa;
  by.bottomLeftCorner<3, 3>() = -bRa * cross(aMb.translation());
  by.bottomRightCorner<3, 3>() = -bRa;
  return calibrated_pose(aMb.inverse(), by * covariance * by.transpose());
}

void put(CalibrationPart& part, const CalibrationSource& source, const StereoSolution& found) {
  const auto lens = [&](CameraRole role, std::size_t k, const std::vector<Estimate>& estimates) {
    part.values.camera(part.camera(role).name).lens =
        calibrated_lens(found.bundle.cameras[k], estimates, found.rms_stereo, found.bundle.views.size(), source);
  };
  lens(CameraRole::kLeft, 0, found.left_estimates);
  lens(CameraRole::kRight, 1, found.right_estimates);
  part.values.stereo = {source, calibrated_inverse(found.rMc, found.covariance)};
}

void put(CalibrationPart& part, const CalibrationSource& source, const RigCamera& camera, const ArmModel& given,
         const HandEyeSolution& found) {
  part.values.camera(camera.name).mount = {source,
                                           calibrated_inverse(found.cMb, found.covariance.topLeftCorner<6, 6>())};
  part.values.gripper = {source, calibrated_pose(found.eMg, found.covariance.block<6, 6>(6, 6))};
  CalibratedJoints joints{source, {}, {}};
  bool refined = false;
  for (std::size_t i = 0; i < joints.theta0.size(); ++i) {
    joints.theta0[i] = found.arm.dh[i].theta0;
    refined |= joints.theta0[i] != given.dh[i].theta0;
    for (const Estimate& e : found.parameters)
      if (e.name == fmt::format("{} zero", kJointNames[i])) joints.sigma[i] = e.sigma;
  }
  if (refined) part.values.joints = joints;
}

void put(CalibrationPart& part, const CalibrationSource& source, const RigCamera& camera,
         const ObjectPoseSolution& found) {
  Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = camera.bMc.linear();
  part.values.object = {source, calibrated_pose(camera.bMc * found.cMo, turn * found.covariance * turn.transpose())};
}

}  // namespace tankrig::app
