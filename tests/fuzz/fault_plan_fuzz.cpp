// Fault plans.
#include "core/input_error.hpp"
#include "sim_backends/faults/fault_plan.hpp"
#include "tests/fuzz/scratch_file.hpp"

using namespace tankrig;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fuzzing::ScratchFolder folder;
  const auto file = folder.put("faults.yaml", bytes, size);
  std::string text;
  fuzzing::refused_or_parsed<InputError>([&] {
    const sim::FaultPlan plan = sim::FaultPlan::load(file);
    text = plan.yaml();
    plan.check(sim::FaultLevel::kMock);
    plan.check(sim::FaultLevel::kWire);
  });
  if (text.empty()) return 0;
  // A session keeps a plan as yaml() writes it.
  const auto kept = folder.put("kept.yaml", reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  if (sim::FaultPlan::load(kept).yaml() != text) std::abort();
  return 0;
}
