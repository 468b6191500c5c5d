// A camera's calibration as figures, for people and programs, and what every command that finds lenses may be asked for.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "apps/tankrig/command_line/command_line.hpp"
#include "calibration/intrinsics/projection_uncertainty.hpp"

namespace tankrig::app {

/// Of a grid of pixels.
struct UncertaintyFigures {
  ProjectionUncertainty::At middle;
  ProjectionUncertainty::At seen;      ///< the worst in the cells of the image that have corners
  ProjectionUncertainty::At anywhere;  ///< the worst
};
UncertaintyFigures uncertainty_figures(const IntrinsicsSolution& solution, double distance);

nlohmann::ordered_json port_json(const FlatPort& port);
nlohmann::ordered_json intrinsics_json(const IntrinsicsSolution& solution, double distance);

void add_lens_model_option(CLI::App* command, std::string& model);
/// Nothing for `auto`.
std::optional<LensModel> lens_model_of(const std::string& model);

/// A flat port before a camera: thickness and indices are given, distance and normal are looked for.
struct PortOptions {
  double thickness_mm = 0;  ///< 0: no port
  FlatPort port{0.02};      ///< its distance is where the search begins
  std::filesystem::path in_air;

  std::optional<FlatPort> tried() const;
};
/// `in_air` says what --in-air names.
void add_port_options(CLI::App* command, PortOptions& options, const char* in_air);

/// `lens`, which `file` holds, if it is one in air that takes pictures of this size.
/// Errors: InputError.
CameraModel lens_in_air(const CameraModel& lens, int width, int height, const std::filesystem::path& file);

}  // namespace tankrig::app
