// The simulated tank: scene, arm, laser and water, seen by its cameras and its lux meter.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "core/time.hpp"
#include "sim_backends/world/exposure.hpp"
#include "sim_backends/world/scene.hpp"
#include "sim_backends/world/true_rig.hpp"

namespace tankrig::sim {

/// A run's changes to the scene file, without editing it.
struct WorldOptions {
  std::optional<double> light;        ///< ambient light, 0 darkness .. 1 the reference (simParams/lightRate)
  std::optional<double> noise;        ///< additive Gaussian sd, 0 .. 0.10 of full scale, every camera
  std::optional<std::string> sensor;  ///< "gaussian" | "emva1288"
  std::optional<double> particles_per_m3;
  std::optional<Vector3d> particle_drift;   ///< of the water, w [m/s]
  std::optional<double> turbidity;          ///< added to attenuation and backscatter of every channel [1/m]
  std::vector<std::string> boards;          ///< of the scene's, by name; the others are not there
  std::optional<TrueRig> truth;             ///< how the rig differs from the scene file
  std::optional<std::uint64_t> truth_seed;  ///< instead of the rig file's
  std::uint64_t seed = 1;
};

/// What one frame shows, before ambient light and noise: the costly part of its rendering. Belongs to the world that
/// made it.
struct FrameLayers;

/// A scene file ready to render. Everything is const after load: one world serves many threads.
/// Frames: w, b, e, c, l, o of core/frames.hpp. Bit-reproducible for a seed on one instruction set, whatever the thread
/// count.
class TankWorld {
 public:
  /// Errors: InputError with file and line. Elements known but not simulated are returned by warnings().
  static TankWorld load(const std::filesystem::path& scene, const WorldOptions& options);
  /// The same for a scene made in code.
  static TankWorld from_scene(Scene scene, const WorldOptions& options);
  ~TankWorld();
  TankWorld(TankWorld&&) noexcept;
  TankWorld& operator=(TankWorld&&) noexcept;

  const std::vector<std::string>& warnings() const;
  const std::vector<CameraSpec>& cameras() const;
  const ArmModel& arm() const;
  const std::vector<BoardSpec>& boards() const;
  /// Where the board called `name` is at `when`, the joints at q; in w.
  /// Errors: InputError if there is none.
  Transform wMt(const std::string& name, Stamp when, const JointVector& q) const;
  Transform wMb() const;
  Transform wMo() const;  ///< the object's mesh frame in the tank
  Transform eMl() const;  ///< the projector on the end effector (sheet: x_l = 0, light along +z_l)
  std::filesystem::path object_mesh() const;
  Duration latency() const;  ///< by which every frame's stamp is late
  double light() const;
  std::string noise_description() const;  ///< for the session: model and its parameters

  /// 8-bit image, 1 or 3 (BGR) channels, of the camera called `name`.
  /// Errors: InputError if there is none.
  cv::Mat render(const std::string& name, const Exposure& exposure) const;

  /// The same in two steps. expose() of the layers, with the light and the noise of another world that differs in
  /// nothing else, gives that world's render() to the bit: ambient light and laser are layers that add up.
  std::shared_ptr<const FrameLayers> layers(const std::string& name, const Exposure& exposure) const;
  cv::Mat expose(const FrameLayers& layers, double light, std::optional<double> noise = {}) const;

  /// The next time after `when` at which a board that is shown comes to another place; nothing if none is shown.
  std::optional<Stamp> next_place(Stamp when) const;
  /// Makes what the camera will see of the boards at `exposure` if it was not made yet, in this thread alone: a picture of a new
  /// place then takes no longer than others.
  void foresee_boards(const std::string& name, const Exposure& exposure) const;

  /// Picture of the whole rig from outside (the paper's Figure 3), BGR, without noise and with the water thinned.
  cv::Mat render_external(const JointVector& q, bool laser_on, int width, int height) const;

  /// Illuminance at the lux meter's pose by radiometry (laser off) [lux].
  double lux() const;

 private:
  struct Impl;
  explicit TankWorld(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tankrig::sim
