// plan.csv: the plan that a session's replay reads back.
#include "core/input_error.hpp"
#include "rig/plan/plan_csv.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("plan.csv", bytes, size);
  return fuzzing::refused_or_parsed<InputError>([&] {
    const ScanPlan plan = read_plan_csv(file);
    const auto again = plan_csv(plan);
    const auto same = folder.put("again.csv", reinterpret_cast<const std::uint8_t*>(again.data()), again.size());
    if (plan_csv(read_plan_csv(same)) != again) std::abort();
    if (plan.segment_at(plan.duration() / 2) >= plan.segments().size()) std::abort();
    (void)plan.uses_laser();
  });
}
