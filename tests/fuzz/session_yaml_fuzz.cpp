// session.yaml: what could be read can be written, and read again to the same: to the letter, but for poses' last
// digits.
#include <cstdlib>
#include <tuple>

#include "core/input_error.hpp"
#include "core/session_names.hpp"
#include "session/reading/session_yaml.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

namespace {

/// Gives `again` the pose of `first`; they must be the same pose.
void take_pose(const Transform& first, Transform& again) {
  if (!again.isApprox(first, 1e-9)) std::abort();
  again = first;
}

/// What a text may leave out, so that no second writing would miss it.
auto facts(const SessionInfo& i) {
  return std::tuple(i.name, i.status, i.kind, i.created_utc, i.clock_begin.has_value(), i.clock_begin && i.clock_end,
                    i.operator_name, i.notes, i.rig, i.rig_hash, i.software, i.noise, i.seed, i.light, i.truth_seed,
                    i.lux_source, i.lux_before, i.lux_after, i.lux_uncertainty, i.simulated_s, i.counts, i.devices,
                    i.timing.has_value(), i.platform, i.tables.size(), i.recovered, i.calibration.arm.has_value(),
                    i.calibration.ePl.has_value());
}

void expect_same(const SessionInfo& first, SessionInfo again) {
  if (again.cameras.size() != first.cameras.size() || again.object.has_value() != first.object.has_value())
    std::abort();
  for (std::size_t i = 0; i < first.cameras.size(); ++i) take_pose(first.cameras[i].bMc, again.cameras[i].bMc);
  if (first.object) take_pose(first.object->bMo, again.object->bMo);
  if (facts(again) != facts(first)) std::abort();
  if (session_yaml(again) != session_yaml(first)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  return fuzzing::refused_or_parsed<InputError>([&] {
    const SessionInfo first = read_session_yaml(folder.put("session.yaml", bytes, size));
    for (const CalibratedCamera& camera : first.cameras)
      if (!is_camera_name(camera.name)) std::abort();
    const std::string text = session_yaml(first);
    const auto again = folder.put("again.yaml", reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    try {
      expect_same(first, read_session_yaml(again));
    } catch (const InputError&) {
      std::abort();
    }
  });
}
