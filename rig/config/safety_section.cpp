#include "rig/config/safety_section.hpp"

#include "core/text_files.hpp"

namespace tankrig {

void read_safety_section(const ConfigNode& node, SafetySettings& s) {
  const auto number = [&](const char* key, double& value, ConfigNode::Range range) {
    value = node.number_or(key, value, range);
  };
  number("indicator_delay_s", s.indicator_delay, {1, 60});
  number("maximum_on_s", s.maximum_on, {1, 3600});
  number("hold_limit_s", s.hold_limit, {1, 3600});
  number("laser_off_allowance_s", s.laser_off_allowance, {0.01, 5});
  number("laser_on_margin_s", s.laser_on_margin, {0.01, 5});
  number("rest_velocity_rad_s", s.rest_velocity, {0.001, 0.1});
  number("rest_timeout_s", s.rest_timeout, {0.2, 60});
  number("camera_timeout_s", s.camera_timeout, {0.1, 60});
  if (s.hold_limit > s.maximum_on)
    node.fail(node.has("hold_limit_s") ? "hold_limit_s" : "maximum_on_s",
              "found a hold_limit_s of " + exact_text(s.hold_limit) + ", expected at most maximum_on_s, " +
                  exact_text(s.maximum_on));
  if (const auto beam = node.optional_child("beam")) {
    s.beam.verify = beam->flag_or("verify", s.beam.verify);
    s.beam.frames = beam->integer_or("frames", s.beam.frames, {2, 100});
    s.beam.dark_frames = beam->integer_or("dark_frames", s.beam.dark_frames, {1, 100});
    if (beam->has("waived")) s.beam.waived = beam->texts("waived");
  }
}

std::string safety_section_yaml(const SafetySettings& s) {
  std::string waived;
  for (const std::string& camera : s.beam.waived) waived += (waived.empty() ? "\"" : ", \"") + camera + "\"";
  return "  safety:\n    indicator_delay_s: " + exact_text(s.indicator_delay) +
         "\n    maximum_on_s: " + exact_text(s.maximum_on) + "\n    hold_limit_s: " + exact_text(s.hold_limit) +
         "\n    laser_off_allowance_s: " + exact_text(s.laser_off_allowance) +
         "\n    laser_on_margin_s: " + exact_text(s.laser_on_margin) +
         "\n    rest_velocity_rad_s: " + exact_text(s.rest_velocity) +
         "\n    rest_timeout_s: " + exact_text(s.rest_timeout) +
         "\n    camera_timeout_s: " + exact_text(s.camera_timeout) +
         "\n    beam:\n      verify: " + (s.beam.verify ? "true" : "false") +
         "\n      frames: " + std::to_string(s.beam.frames) +
         "\n      dark_frames: " + std::to_string(s.beam.dark_frames) + "\n      waived: [" + waived + "]\n";
}

}  // namespace tankrig
