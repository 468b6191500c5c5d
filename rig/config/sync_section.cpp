#include "rig/config/sync_section.hpp"

#include "core/text_files.hpp"

namespace tankrig {
namespace {

constexpr ConfigRange kMilli{0, 1e6};

}  // namespace

void read_sync_section(const ConfigNode& node, SyncGate& gate) {
  const auto sync = node.optional_child("sync");
  if (!sync) return;
  gate.max_residual = 1e-3 * sync->number_or("max_residual_ms", 1e3 * gate.max_residual, kMilli);
  gate.max_residual_on_target = 1e-3 * sync->number_or("max_residual_mm", 1e3 * gate.max_residual_on_target, kMilli);
}

std::string sync_section_yaml(const SyncGate& gate) {
  return "  sync:\n    max_residual_ms: " + exact_text(1e3 * gate.max_residual) +
         "\n    max_residual_mm: " + exact_text(1e3 * gate.max_residual_on_target) + "\n";
}

}  // namespace tankrig
