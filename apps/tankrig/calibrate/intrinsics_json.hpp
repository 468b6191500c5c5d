// A camera's calibration as figures, for people and programs.
#pragma once

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

nlohmann::ordered_json intrinsics_json(const IntrinsicsSolution& solution, double distance);

void add_lens_model_option(CLI::App* command, std::string& model);
/// Nothing for `auto`.
std::optional<LensModel> lens_model_of(const std::string& model);

}  // namespace tankrig::app
