#include "rig/config/limits_section.hpp"

#include <algorithm>

#include "core/text_files.hpp"

namespace tankrig {

void read_limits_section(const ConfigNode& scan, JointLimits& limits) {
  const auto node = scan.optional_child("limits");
  if (!node) return;
  limits.beyond = node->number_or("beyond_rad", limits.beyond, {0, 0.2});
  limits.refusal_margin = node->number_or("refusal_margin_rad", limits.refusal_margin, {0, 1});
  limits.velocity = node->number_or("velocity_rad_s", limits.velocity, {0.01, 10});
  limits.ticks_per_s = node->number_or("ticks_per_s", limits.ticks_per_s, {1, 1e6});
  limits.velocity_window = node->milliseconds_or("velocity_window_ms", limits.velocity_window, {10, 1000});
  limits.set_point_step = node->number_or("set_point_step_rad_s", limits.set_point_step, {0, 10});
  limits.current.amperes = node->number_or("current_a", limits.current.amperes, {0.1, 50});
  limits.current.duration = from_seconds(node->number_or("current_s", seconds(limits.current.duration), {0, 60}));
}

void read_backlash(const ConfigNode& arm, std::array<double, kJoints>& play_ticks) {
  if (!arm.has("backlash_ticks")) return;
  const auto values = arm.numbers("backlash_ticks", kJoints);
  if (*std::min_element(values.begin(), values.end()) < 0)
    arm.fail("backlash_ticks", "found a negative number, expected five of 0 or more");
  std::copy(values.begin(), values.end(), play_ticks.begin());
}

std::string backlash_yaml(const std::array<double, kJoints>& play_ticks) {
  std::string list;
  for (const double ticks : play_ticks) list += (list.empty() ? "" : ", ") + exact_text(ticks);
  return "  backlash_ticks: [" + list + "]\n";
}

std::string limits_section_yaml(const JointLimits& limits) {
  return "  limits:\n    beyond_rad: " + exact_text(limits.beyond) +
         "\n    refusal_margin_rad: " + exact_text(limits.refusal_margin) +
         "\n    velocity_rad_s: " + exact_text(limits.velocity) +
         "\n    ticks_per_s: " + exact_text(limits.ticks_per_s) +
         "\n    velocity_window_ms: " + exact_text(1e3 * seconds(limits.velocity_window)) +
         "\n    set_point_step_rad_s: " + exact_text(limits.set_point_step) +
         "\n    current_a: " + exact_text(limits.current.amperes) +
         "\n    current_s: " + exact_text(seconds(limits.current.duration)) + "\n";
}

}  // namespace tankrig
