// A benchmark file: what is measured, from when to when, and what is changed from one run to the next.
//
// The vocabulary is the UWSim benchmarking module's (elements, nesting, constants, defaults); ours extends it by new
// elements. docs/reference/benchmark.md has every element with its unit.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bench/external/limited_run.hpp"
#include "core/enum_names.hpp"
#include "core/frames.hpp"

namespace tankrig {

enum class TriggerKind : std::uint8_t {
  kTopic,
  kOnInit,
  kNever,
  kService,
  kOnMove,
  kOnNoMove,
  kPosition,
  kJointAngle,
  kScanPhase,
  kLuxLevel,
};
template <>
inline constexpr std::array kNames<TriggerKind>{"topic",    "onInit",   "never",      "service",   "onMove",
                                                "onNoMove", "position", "jointAngle", "scanPhase", "luxLevel"};

/// <startOn> or <stopOn>.
struct Trigger {
  TriggerKind kind = TriggerKind::kNever;
  int line = 0;
  std::string target;                    ///< as the file calls it; may be empty
  Vector3d position = Vector3d::Zero();  ///< of kPosition [m]
  double value = 0;                      ///< of kJointAngle [rad] and kLuxLevel [lx]
};

enum class MeasureKind : std::uint8_t {
  kTime,
  kCollision,
  kPositionError,
  kDistance,
  kEuclideanNorm,
  kObjectCenteredOnCam,
  kReconstruction3D,
  kPathFollowing,
  kEnergy,
  kSyncResidual,
  kSweepVelocityError,
  kFramesLost,
};
template <>
inline constexpr std::array kNames<MeasureKind>{
    "time",          "collision",           "positionError",      "distance",
    "euclideanNorm", "objectCenteredOnCam", "reconstruction3D",   "pathFollowing",
    "energy",        "syncResidual",        "sweepVelocityError", "framesLost"};

enum class GroundTruthKind : std::uint8_t { kConstant, kCornersFromCamera, kCentroidFromCamera, kRelativeLocation };
template <>
inline constexpr std::array kNames<GroundTruthKind>{"constant", "cornersFromCamera", "centroidFromCamera",
                                                    "relativeLocation"};

struct GroundTruth {
  GroundTruthKind kind = GroundTruthKind::kConstant;
  std::vector<double> values;              ///< kConstant
  std::string camera, target, publish_on;  ///< *FromCamera; publish_on may be empty
  std::string from, to;                    ///< kRelativeLocation
};

/// Which arithmetic a reconstruction3D follows: the paper's words, or the reference module's code.
enum class Arithmetic : std::uint8_t { kPaper, kUwsim };
template <>
inline constexpr std::array kNames<Arithmetic>{"paper", "uwsim"};

inline constexpr double kLevelOfDetail = 0.003;  ///< the reference module's default [m]

struct Measure {
  MeasureKind kind = MeasureKind::kTime;
  int line = 0;
  std::string name;
  std::string target;  ///< a body; of kEuclideanNorm a stream of numbers
  std::string topic, from, camera;
  Vector3d position = Vector3d::Zero();
  GroundTruth truth;
  Arithmetic arithmetic = Arithmetic::kPaper;
  /// [m]: with kUwsim the lattice's step, else the threshold of coverage; absent: kLevelOfDetail, or the rig file's
  std::optional<double> level_of_detail;
  bool detailed_to_globals = false;  ///< its details stand in the result table, not its first value alone
  std::optional<double> log_s;       ///< interval of its log [s]
  Trigger start, stop;
};

enum class UpdaterKind : std::uint8_t {
  kNone,
  kFog,
  kBagFog,
  kCurrent,
  kArmMove,
  kRepeat,
  kLight,
  kNoise,
  kParticles,
  kSweepSpeed,
  kAlgorithm,
  kCalibrationError,
  kLux,
};
template <>
inline constexpr std::array kNames<UpdaterKind>{"none",
                                                "sceneFogUpdater",
                                                "bagFogUpdater",
                                                "currentForceUpdater",
                                                "armMoveUpdater",
                                                "repeat",
                                                "sceneLightUpdater",
                                                "cameraNoiseUpdater",
                                                "particlesUpdater",
                                                "sweepSpeedUpdater",
                                                "algorithmUpdater",
                                                "calibrationErrorUpdater",
                                                "luxUpdater"};

/// Of kCalibrationError: what of a pose is wrong, in its own frame.
struct PoseError {
  int axis = 0;        ///< 0 x, 1 y, 2 z
  bool turns = false;  ///< about the axis [rad]; else along it [m]
};

/// Of kCurrent.
struct CurrentSwing {
  double theta = 0, phi = 0, theta_variation = 0, phi_variation = 0, theta_period = 1, phi_period = 1;  ///< rad, s
  double force_variation = 0, force_period = 1, random = 0;
  bool as_force = false;
};

/// One loop of the product. Its values are first, first + step, ... up to last, half a millionth of a step beyond it
/// included: the reference adds up floats, which is why its files end at 1.02 to include 1.
struct Updater {
  UpdaterKind kind = UpdaterKind::kNone;
  int line = 0;
  double first = 0, last = 0, step = 1;
  double interval_s = 0;  ///< read, and not used: a configuration lasts as long as its scan
  std::string target;
  std::vector<std::vector<double>> arm_positions;  ///< kArmMove [rad]
  CurrentSwing current;
  std::vector<std::string> clouds;           ///< kAlgorithm
  PoseError error;                           ///< kCalibrationError
  std::string bag, image_topic, info_topic;  ///< kBagFog; its bag: a recorded session's folder
  double image_depth_m = 0;                  ///< kBagFog: from the cameras to what they see
  std::vector<double> levels;                ///< kLux, in place of first, last and step [lx]
  double tolerance = 0.1;                    ///< kLux: of a level, as a share of it

  /// How the column of its values is called: "Light", "Noise", "Iteration" ...
  const char* column() const;
  std::size_t count() const;
  double value(std::size_t index) const;
  double highest() const;
  /// As tables show it: the cloud's name of kAlgorithm, else the number.
  std::string shown(double value) const;
};

/// Somebody's program that makes a cloud of a session, under limits (docs/reference/algorithms.md).
struct Algorithm {
  int line = 0;
  std::string name;               ///< of its cloud
  std::filesystem::path program;  ///< as the file has it, below the file's folder; without a slash: one of PATH
  std::vector<std::string> arguments;
  bool by_laser = false;  ///< it uses the laser's camera, else the stereo pair
  RunLimits limits;
};

/// What <topic> calls the cloud that an algorithmUpdater has chosen.
inline constexpr const char* kChosenCloud = "algorithm";

/// A global result: a muParser expression over measures and their details, "distance/battery", "laser.coverage".
struct Function {
  int line = 0;
  std::string name;  ///< "TOTAL" if the file gives none
  std::string expression;
  bool publish = false;
  double publish_rate_s = 0.1;
};

struct Benchmark {
  std::filesystem::path file;
  Arithmetic arithmetic = Arithmetic::kPaper;  ///< of measures that do not say theirs
  std::vector<Algorithm> algorithms;
  std::vector<Measure> measures;
  Trigger start, stop;
  std::vector<Function> functions;
  std::vector<Updater> updaters;      ///< the outermost first; `none` leaves it empty
  std::vector<std::string> warnings;  ///< "FILE:LINE: ..."

  /// Number of configurations: the product of the updaters' counts.
  std::size_t points() const;
  /// The updaters' values at configuration `point`, the innermost changing fastest.
  std::vector<double> values(std::size_t point) const;
};

/// Older tag names are taken with a warning; unknown elements are refused.
/// Errors: InputError "FILE:LINE: element: found ..., expected ...".
Benchmark read_benchmark(const std::filesystem::path& file);

}  // namespace tankrig
