#include "sim_backends/faults/fault_script.hpp"

#include <algorithm>

namespace tankrig::sim {
namespace {

constexpr Duration kForEver = std::chrono::hours{24 * 365};

Duration length(const FaultSpec& spec) { return spec.duration.count() > 0 ? spec.duration : kForEver; }

}  // namespace

FaultScript::FaultScript(FaultPlan plan)
    : plan_(std::move(plan)), zero_ns_(plan_.faults.size()), told_(plan_.faults.size(), 0) {
  for (std::atomic<std::int64_t>& zero : zero_ns_) zero = kNotYet;
}

void FaultScript::mark(FaultOrigin origin, Stamp when) noexcept {
  for (std::size_t i = 0; i < zero_ns_.size(); ++i) {
    std::int64_t unset = kNotYet;
    if (plan_.faults[i].origin == origin) zero_ns_[i].compare_exchange_strong(unset, when.ns);
  }
}

void FaultScript::enter_phase(std::string_view name, Stamp when) noexcept {
  for (std::size_t i = 0; i < zero_ns_.size(); ++i) {
    std::int64_t unset = kNotYet;
    if (plan_.faults[i].origin == FaultOrigin::kPhase && name.starts_with(plan_.faults[i].phase))
      zero_ns_[i].compare_exchange_strong(unset, when.ns);
  }
}

std::optional<Stamp> FaultScript::begin(std::size_t index) const noexcept {
  const std::int64_t zero = zero_ns_[index].load(std::memory_order_relaxed);
  if (zero == kNotYet) return std::nullopt;
  return Stamp{zero} + plan_.faults[index].at;
}

bool FaultScript::active(std::size_t index, Stamp now) const noexcept {
  const auto since = begin(index);
  return since && now >= *since && now < *since + length(plan_.faults[index]);
}

const FaultSpec* FaultScript::active(FaultDevice device, FaultKind kind, Stamp now,
                                     std::string_view camera) const noexcept {
  for (std::size_t i = 0; i < plan_.faults.size(); ++i) {
    const FaultSpec& s = plan_.faults[i];
    if (s.device == device && s.kind == kind && (s.camera.empty() || s.camera == camera) && active(i, now)) return &s;
  }
  return nullptr;
}

bool FaultScript::off_now(FaultDevice device, Stamp now, std::string_view camera) const noexcept {
  const FaultSpec* spec = active(device, FaultKind::kIntermittent, now, camera);
  if (!spec) return false;
  const Duration since = now - *begin(index_of(*spec));
  return fault_chance(spec->seed, static_cast<std::uint64_t>(since / spec->period)) < spec->ratio;
}

Duration FaultScript::left(const FaultSpec& spec, Stamp now) const noexcept {
  const auto since = begin(index_of(spec));
  return since ? *since + length(spec) - now : Duration{0};
}

std::vector<std::string> FaultScript::waiting(Stamp now) const {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < plan_.faults.size(); ++i)
    if (const auto since = begin(i); !since || *since > now) out.push_back(plan_.faults[i].name());
  return out;
}

std::vector<FaultEvent> FaultScript::news(Stamp now) {
  std::vector<FaultEvent> events;
  for (std::size_t i = 0; i < plan_.faults.size(); ++i) {
    const auto since = begin(i);
    if (!since) continue;
    const auto tell = [&](std::uint8_t stage, Stamp when, const char* what) {
      if (told_[i] + 1 != stage || when > now) return;
      told_[i] = stage;
      events.push_back({when, plan_.faults[i].name() + what});
    };
    tell(1, *since, " begins");
    if (plan_.faults[i].duration.count() > 0) tell(2, *since + plan_.faults[i].duration, " ends");
  }
  std::stable_sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.when < b.when; });
  return events;
}

}  // namespace tankrig::sim
