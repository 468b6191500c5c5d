#include "apps/tankrig/calibrate/intrinsics_json.hpp"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "apps/tankrig/calibrate/facts.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"

namespace tankrig::app {
namespace {

nlohmann::ordered_json uncertainty_json(const ProjectionUncertainty::At& at) {
  return {{"px", at.px}, {"px_independent", at.independent_px}, {"mm", 1e3 * at.metres}};
}

}  // namespace

UncertaintyFigures uncertainty_figures(const IntrinsicsSolution& s, double distance) {
  const ProjectionUncertainty uncertainty(s);
  const double w = s.camera.width, h = s.camera.height;
  UncertaintyFigures figures;
  if (const auto middle = uncertainty.at({(w - 1) / 2, (h - 1) / 2}, distance)) figures.middle = *middle;
  for (int row = 0; row < ImageCoverage::kRows; ++row)
    for (int column = 0; column < ImageCoverage::kColumns; ++column) {
      const auto at = uncertainty.at(
          {(column + 0.5) * w / ImageCoverage::kColumns, (row + 0.5) * h / ImageCoverage::kRows}, distance);
      if (!at) continue;
      if (s.coverage.corners[static_cast<std::size_t>(row * ImageCoverage::kColumns + column)] > 0 &&
          at->px > figures.seen.px)
        figures.seen = *at;
    }
  for (int row = 0; row <= ImageCoverage::kRows; ++row)
    for (int column = 0; column <= ImageCoverage::kColumns; ++column)
      if (const auto at = uncertainty.at(
              {column * (w - 1) / ImageCoverage::kColumns, row * (h - 1) / ImageCoverage::kRows}, distance);
          at && at->px > figures.anywhere.px)
        figures.anywhere = *at;
  return figures;
}

nlohmann::ordered_json port_json(const FlatPort& port) {
  return {{"distance_m", port.distance},
          {"thickness_m", port.thickness},
          {"normal", {port.normal.x(), port.normal.y(), port.normal.z()}},
          {"index_air", port.air},
          {"index_glass", port.glass},
          {"index_water", port.water}};
}

nlohmann::ordered_json intrinsics_json(const IntrinsicsSolution& s, double distance) {
  nlohmann::ordered_json out{{"rms_px", s.rms},
                             {"sigma_px", s.noise.sigma},
                             {"correlation_allowance", s.noise.allowance},
                             {"model", name_of(s.lens)},
                             {"decision", s.decision},
                             {"size_px", {s.camera.width, s.camera.height}},
                             {"parameters", estimates_json(s.estimates)}};
  if (s.camera.port) out["port"] = port_json(*s.camera.port);
  for (const TriedModel& m : s.tried)
    out["models"].push_back({{"model", name_of(m.lens)},
                             {"target", m.bends ? "bent" : "flat"},
                             {"port", m.port},
                             {"parameters", m.parameters},
                             {"rms_px", m.rms},
                             {"held_back_rms_px", m.held_back_rms},
                             {"excess_px2", m.excess},
                             {"excess_sigma_px2", m.excess_sigma}});
  out["pictures"] = nlohmann::ordered_json::array();
  for (const PictureFit& p : s.pictures)
    out["pictures"].push_back({{"name", p.name},
                               {"corners", p.corners},
                               {"rms_px", p.rms},
                               {"distance_m", p.distance},
                               {"tilt_deg", to_degrees(p.tilt)},
                               {"left_out", p.left_out}});
  out["left_out_corners"] = s.left_out_corners.size();
  out["coverage"] = {{"share", s.coverage.share},
                     {"columns", ImageCoverage::kColumns},
                     {"rows", ImageCoverage::kRows},
                     {"corners", s.coverage.corners}};
  const UncertaintyFigures u = uncertainty_figures(s, distance);
  out["projection_uncertainty"] = {{"distance_m", distance},
                                   {"middle", uncertainty_json(u.middle)},
                                   {"worst_where_seen", uncertainty_json(u.seen)},
                                   {"worst", uncertainty_json(u.anywhere)}};
  return out;
}

void add_lens_model_option(CLI::App* command, std::string& model) {
  std::vector<std::string> names{"auto"};
  for (const LensModel lens : kLensModels)
    if (lens != LensModel::kRational) names.emplace_back(name_of(lens));
  model = "auto";
  command->add_option("--model", model, "Lens model; auto: the simplest that fits pictures held back")
      ->check(CLI::IsMember(names))
      ->capture_default_str();
}

std::optional<LensModel> lens_model_of(const std::string& model) {
  for (const LensModel lens : kLensModels)
    if (model == name_of(lens)) return lens;
  return std::nullopt;
}

std::optional<FlatPort> PortOptions::tried() const {
  if (!(thickness_mm > 0)) return std::nullopt;
  FlatPort tried = port;
  tried.thickness = 1e-3 * thickness_mm;
  return tried;
}

void add_port_options(CLI::App* command, PortOptions& options, const char* in_air) {
  CLI::Option* thickness =
      command
          ->add_option(
              "--port-mm", options.thickness_mm,
              "Thickness of a flat port before each camera: its refraction is tried too, and taken if it fits better")
          ->check(CLI::Range(0.1, 200.0));
  command
      ->add_option("--port-index", options.port.glass, "Refractive index of its pane (acrylic 1.49, window glass 1.52)")
      ->capture_default_str()
      ->check(CLI::Range(1.2, 2.5))
      ->needs(thickness);
  command->add_option("--water-index", options.port.water, "Refractive index of the water (fresh 1.333, sea 1.34)")
      ->capture_default_str()
      ->check(CLI::Range(1.2, 1.5))
      ->needs(thickness);
  command->add_option("--in-air", options.in_air, in_air)->needs(thickness);
}

CameraModel lens_in_air(const CameraModel& lens, int width, int height, const std::filesystem::path& file) {
  if (lens.width != width || lens.height != height)
    throw InputError(file, fmt::format("found a camera of {}x{} px, expected {}x{} as the pictures", lens.width,
                                       lens.height, width, height));
  if (lens.port)
    throw InputError(file, "found a camera behind a flat port, expected its lens as boards in air told it");
  return lens;
}

}  // namespace tankrig::app
