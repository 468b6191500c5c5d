// A scene file's content: the tank and everything in it, before rendering.
//
// It uses UWSim's own scene vocabulary, extended where that lacks a word: docs/reference/scene.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/arm_model.hpp"
#include "core/camera_model.hpp"
#include "core/frames.hpp"
#include "sim_backends/world/board.hpp"

namespace tankrig::sim {

using Rgb = Eigen::Array3f;  ///< linear red, green, blue

/// Lambertian surface with a procedural texture, the same from every run.
struct Material {
  enum class Texture {
    kPlain,
    kSpeckle,
    kLabels
  };  ///< kLabels: scratches, lettering bars and stripes of a mock-up box
  Rgb albedo{0.4f, 0.4f, 0.4f};
  Texture texture = Texture::kPlain;
  float contrast = 0;   ///< relative amplitude of the texture, [0, 1]
  double scale = 0.01;  ///< size of its grain [m]
};

struct TankWalls {
  Vector3d size{2.0, 2.0, 1.5};  ///< x, y, z [m]; the origin of w is the centre of the floor
  double water_depth = 1.4;      ///< [m]
  Material floor, walls;
};

/// Single scattering with separate coefficients per channel.
struct Water {
  Rgb attenuation{0.34f, 0.05f, 0.06f};  ///< beam attenuation c of direct light [1/m]
  Rgb backscatter{0.30f, 0.06f, 0.07f};  ///< rate at which the veil saturates [1/m]
  Rgb veil{
      0.0f, 0.01f,
      0.02f};  ///< radiance of infinitely deep water at light 1, as the radiance of a white surface under 1 lux x this lux [lx/pi]
  float laser_scattering =
      0.01f;  ///< scattering coefficient times phase function towards the camera: glow of the sheet [1/(m sr)]
  double particles_per_m3 = 0;
  double particle_radius = 0.0004;               ///< mean [m]
  Vector3d particle_drift{0.01, 0.004, -0.002};  ///< [m/s]
};

/// A lamp: point source with a cone, photometric.
struct Lamp {
  std::string name;
  Vector3d position = Vector3d::Zero();  ///< w
  Vector3d direction{0, 0, -1};          ///< w, unit
  double candela = 0;                    ///< on the axis, at light 1
  double half_angle = 1.0;               ///< [rad]; intensity falls as a cosine power to 10 % there
  Rgb colour{1, 1, 1};
};

struct SceneObject {
  std::string name;
  std::filesystem::path mesh;
  Transform wMo = Transform::Identity();
  Material material;
  bool target = false;  ///< the object that is measured
};

/// How a camera turns light into numbers.
struct Sensor {
  enum class Model { kGaussian, kEmva1288 };
  Model model = Model::kGaussian;
  double gaussian_sd = 0;          ///< of full scale, [0, 1]; UWSim's `std`
  double electrons_per_lux_s = 0;  ///< photo-electrons per lux of exitance (white, unit albedo) and second of exposure
  double full_well_e = 8000;       ///< electrons at full scale
  double read_noise_e = 12;        ///< EMVA sigma_d
  double prnu = 0.005;             ///< EMVA, relative
  double dark_e = 5;               ///< EMVA mu_d
};

struct CameraSpec {
  std::string name;
  CameraModel model;
  Transform wMc = Transform::Identity();
  int channels = 3;
  double rate_hz = 25;
  double exposure_s = 0.010;
  double psf_sigma_px = 0.7;  ///< optics
  Sensor sensor;
};

/// UWSim's structuredLightProjector reduced to a line.
/// Frames: l. The sheet is x_l = 0 about +z_l.
struct LaserLine {
  std::string name;
  Transform eMl = Transform::Identity();
  double fan = 0.9;            ///< full opening angle in the sheet [rad]
  double power_lm = 6.0;       ///< luminous flux (10 mW at 532 nm: 6 lm)
  double half_width = 0.0006;  ///< 1/e^2 half-width at the exit [m]
  double divergence = 0.0008;  ///< growth of the half-width [rad]
  double speckle_contrast = 0.2;
  Rgb colour{0.10f, 1.0f, 0.16f};  ///< response of the camera's channels to the line
};

struct LuxMeterSpec {
  Vector3d position = Vector3d::Zero();  ///< w
  Vector3d normal = Vector3d::UnitZ();   ///< w
};

struct ArmSpec {
  std::string name;
  ArmModel model = arm5e();
  Transform wMb = Transform::Identity();
  JointVector q = JointVector::Zero();  ///< posture at power-on
  Rgb albedo{0.55f, 0.5f, 0.1f};
  double link_radius = 0.045;  ///< of the primitive bodies [m]
};

struct Scene {
  std::filesystem::path file;
  double light = 1.0;       ///< simParams/lightRate, [0, 1]
  double ambient_lux = 60;  ///< diffuse downwelling illuminance at the surface at light 1
  TankWalls tank;
  Water water;
  ArmSpec arm;
  LaserLine laser;
  std::vector<Lamp> lamps;
  std::vector<SceneObject> objects;
  std::vector<CameraSpec> cameras;
  std::vector<BoardSpec> boards;  ///< in the file: all of them; in a world: those that were asked for
  LuxMeterSpec lux_meter;
  std::vector<std::string> warnings;  ///< elements known to UWSim but not simulated, with their lines
};

/// Reads a scene file.
/// Errors: InputError "FILE:LINE: ...", also for an unknown element or a value out of range.
Scene read_scene(const std::filesystem::path& file);

}  // namespace tankrig::sim
