// The rig file's `reconstruction: laser:` and `laser_paper:` sections.

#include <fmt/core.h>

#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"

namespace tankrig {
namespace {

StripeOrientation orientation_from(const ConfigNode& node, StripeOrientation fallback,
                                   const std::vector<std::string>& allowed) {
  if (!node.has("orientation")) return fallback;
  const std::string name = node.choice("orientation", allowed);
  if (name == "auto") return StripeOrientation::kAuto;
  return name == "rows" ? StripeOrientation::kRows : StripeOrientation::kColumns;
}

void read_interval(const ConfigNode& node, const std::string& name, double limit, int& lower, int& upper) {
  lower = node.integer_or(name + "_min", lower, {0, limit});
  upper = node.integer_or(name + "_max", upper, {0, limit});
  if (lower > upper) node.fail(name + "_min", fmt::format("found {}, expected at most {}_max, {}", lower, name, upper));
}

}  // namespace

StripeParameters stripe_parameters_from(const ConfigNode& node) {
  StripeParameters p;
  p.orientation = orientation_from(node, p.orientation, {"auto", "columns", "rows"});
  p.min_snr = node.number_or("min_snr", p.min_snr, {2, 100});
  p.max_step_px = node.number_or("max_step_px", p.max_step_px, {0.5, 100});
  p.min_run = node.integer_or("min_run", p.min_run, {1, 10000});
  p.max_width_ratio = node.number_or("max_width_ratio", p.max_width_ratio, {1, 100});
  p.max_skew = node.number_or("max_skew", p.max_skew, {0, 100});
  p.max_second_peak = node.number_or("max_second_peak", p.max_second_peak, {0, 1});
  p.smoothing_px = node.integer_or("smoothing_px", p.smoothing_px, {0, 50});
  p.speckle_floor_px = node.number_or("speckle_floor_px", p.speckle_floor_px, {0, 10});
  return p;
}

PaperStripeParameters paper_stripe_parameters_from(const ConfigNode& node) {
  PaperStripeParameters p;
  if (node.has("preset") && node.choice("preset", {"real", "simulation"}) == "simulation")
    p = PaperStripeParameters::simulation();
  p.orientation = orientation_from(node, p.orientation, {"columns", "rows"});
  read_interval(node, "hue", 179, p.hue_min, p.hue_max);
  read_interval(node, "saturation", 255, p.saturation_min, p.saturation_max);
  read_interval(node, "value", 255, p.value_min, p.value_max);
  p.half_window = node.integer_or("half_window_px", p.half_window, {0, 100});
  p.blur = node.flag_or("blur", p.blur);
  p.morphology = node.flag_or("morphology", p.morphology);
  return p;
}

}  // namespace tankrig
