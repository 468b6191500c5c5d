#include "rig/config/real_time_section.hpp"

#include "core/shown_text.hpp"
#include "core/text_files.hpp"

namespace tankrig {
namespace {

constexpr int kMostCpus = 1024, kMostOverruns = 10'000;

std::optional<int> cpu_from(const ConfigNode& node) {
  const std::string text = node.text("cpu");
  if (text == "none") return std::nullopt;
  int cpu = -1;
  if (!parse_number(text, cpu) || cpu < 0 || cpu >= kMostCpus)
    node.fail("cpu", "found '" + shown_text(text) + "', expected none or the number of a processor, from 0");
  return cpu;
}

}  // namespace

void read_real_time_section(const ConfigNode& scan, RealTimeSettings& s) {
  const auto node = scan.optional_child("real_time");
  if (!node) return;
  s.required = node->flag_or("required", s.required);
  s.priority = node->integer_or("priority", s.priority, {1, 98});
  if (node->has("cpu")) s.cpu = cpu_from(*node);
  s.lock_memory = node->flag_or("lock_memory", s.lock_memory);
  if (const auto overruns = node->optional_child("overruns")) {
    s.overruns = overruns->integer_or("limit", s.overruns, {0, kMostOverruns});
    s.window = overruns->number_or("window_s", s.window, {0.001, 600});
  }
  if (node->has("pace"))
    s.pace = node->choice("pace", {"clock", "device"}) == "device" ? CyclePace::kDevice : CyclePace::kClock;
}

std::string real_time_section_yaml(const RealTimeSettings& s) {
  return "  real_time:\n    required: " + yaml_bool(s.required) + "\n    priority: " + std::to_string(s.priority) +
         "\n    cpu: " + (s.cpu ? std::to_string(*s.cpu) : "none") + "\n    lock_memory: " + yaml_bool(s.lock_memory) +
         "\n    overruns:\n      limit: " + std::to_string(s.overruns) + "\n      window_s: " + exact_text(s.window) +
         "\n    pace: " + (s.pace == CyclePace::kDevice ? "device" : "clock") + "\n";
}

}  // namespace tankrig
