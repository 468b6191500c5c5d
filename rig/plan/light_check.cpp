#include "rig/plan/light_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "core/input_error.hpp"
#include "rig/safety/beam_check.hpp"

namespace tankrig {
namespace {

constexpr double kRounding = 1e-9;

/// Longest run of segments that `in` holds for, from the first one's begin to the last one's end; runs with less than
/// `gap` between them are one.
template <class In>
double longest(const ScanPlan& plan, double gap, In in) {
  double most = 0, begin = 0, end = -1;
  for (const Segment& s : plan.segments()) {
    if (!in(s)) continue;
    if (end < 0 || s.begin - end > gap + kRounding) begin = s.begin;
    end = s.end();
    most = std::max(most, end - begin);
  }
  return most;
}

[[noreturn]] void refuse(const char* key, double found, double needed, const char* what) {
  char line[160];
  std::snprintf(line, sizeof line, "scan: safety: %s: found %g, expected at least the %.1f s of the plan's %s", key,
                found, needed, what);
  throw InputError(line);
}

}  // namespace

std::optional<double> first_light(const ScanPlan& plan) {
  for (const Segment& s : plan.segments())
    if (s.laser) return s.begin;
  return std::nullopt;
}

void check_light(const ScanPlan& plan, const SafetySettings& settings) {
  const double lit = longest(plan, settings.indicator_delay, [](const Segment& s) { return s.laser; });
  if (lit > settings.maximum_on + kRounding)
    refuse("maximum_on_s", settings.maximum_on, lit, "longest stretch of light");
  const double held = longest(plan, 0, [](const Segment& s) { return s.hold; });
  if (held > settings.hold_limit + kRounding) refuse("hold_limit_s", settings.hold_limit, held, "light at rest");
  for (const Segment& s : plan.segments())
    if (s.hold && s.motion.from() != s.motion.to())
      throw InputError("scan: found motion in \"" + s.name + "\", expected none where light is held at rest");
}

bool testifies(const BeamSettings& settings, const std::string& camera) {
  return settings.verify && std::find(settings.waived.begin(), settings.waived.end(), camera) == settings.waived.end();
}

void check_witness(const ScanPlan& plan, const BeamSettings& settings, const CameraInfo& camera, RecordWhen record) {
  if (!plan.uses_laser() || !testifies(settings, camera.name)) return;
  const auto refuse = [&](const std::string& why) {
    throw InputError("camera " + camera.name + ": the beam check does not work: " + why +
                     "; or go without its word: scan: safety: beam: waived: [" + camera.name + "]");
  };
  if (std::min(camera.width, camera.height) < StripeSign::kSmallest)
    refuse(
        fmt::format("no stripe is told in pictures so small (width_px, height_px: found {} x {}, expected {} or more)",
                    camera.width, camera.height, StripeSign::kSmallest));
  if (record == RecordWhen::kDark) return;
  const auto& segments = plan.segments();
  const bool dark_block =
      std::any_of(segments.begin(), segments.end(), [](const Segment& s) { return s.phase == Phase::kDarkBefore; });
  if (record == RecordWhen::kAll && dark_block) return;
  refuse(std::string("the camera never sees the dark (") +
         (dark_block ? "record: found sweep, expected all" : "scan: dark_frames: found 0, expected 1 or more") + ")");
}

}  // namespace tankrig
