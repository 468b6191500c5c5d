#include "apps/tankrig/bench/bench_names.hpp"

namespace tankrig::app {

BenchmarkNames benchmark_names(const RigConfig& rig) {
  BenchmarkNames names;
  const auto section = rig.section("benchmark");
  if (!section) return names;
  if (const auto table = section->optional_child("names"))
    for (const std::string& theirs : table->keys()) names.ours[theirs] = table->text(theirs);
  section->finish();
  return names;
}

std::string benchmark_key_rows() {
  return "| `benchmark.names.NAME` | NAME itself | a text | what benchmark files call NAME "
         "([benchmark.md](benchmark.md)) |\n";
}

}  // namespace tankrig::app
