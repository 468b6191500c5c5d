#include "drivers/arm/arm_counts.hpp"

#include <utility>

namespace tankrig {
namespace {

constexpr std::array<std::pair<const char*, ArmCounts::Count ArmCounts::*>, 11> kOwn{
    {{"exchanges", &ArmCounts::exchanges},
     {"timeouts", &ArmCounts::timeouts},
     {"mute_retries", &ArmCounts::mute_retries},
     {"late_answers", &ArmCounts::late_answers},
     {"stale", &ArmCounts::stale},
     {"jumps_rejected", &ArmCounts::jumps_rejected},
     {"jumps", &ArmCounts::jumps},
     {"watchdog_stops", &ArmCounts::watchdog_stops},
     {"over_currents", &ArmCounts::over_currents},
     {"water_alarms", &ArmCounts::water_alarms},
     {"disconnects", &ArmCounts::disconnects}}};

constexpr std::array<std::pair<const char*, std::uint64_t ArmLinkCounters::*>, 10> kOfTheLink{
    {{"checksum_errors", &ArmLinkCounters::checksum_errors},
     {"length_errors", &ArmLinkCounters::length_errors},
     {"discarded_bytes", &ArmLinkCounters::discarded_bytes},
     {"resyncs", &ArmLinkCounters::resyncs},
     {"wrong_ids", &ArmLinkCounters::wrong_ids},
     {"wrong_lengths", &ArmLinkCounters::wrong_lengths},
     {"incomplete", &ArmLinkCounters::incomplete},
     {"unknown_slots", &ArmLinkCounters::unknown_slots},
     {"send_buffer_full", &ArmLinkCounters::send_buffer_full},
     {"reopened", &ArmLinkCounters::reopened}}};

}  // namespace

void ArmCounts::publish(const ArmLinkCounters& link, const ArmReadings& readings) noexcept {
  for (std::size_t i = 0; i < link_.size(); ++i) link_[i].store(link.*kOfTheLink[i].second, std::memory_order_relaxed);
  current_a_.store(readings.current_a, std::memory_order_relaxed);
  voltage_v_.store(readings.voltage_v, std::memory_order_relaxed);
  temperature_c_.store(readings.master_temperature_c, std::memory_order_relaxed);
}

Statistics ArmCounts::statistics() const {
  Statistics all;
  for (const auto& [name, count] : kOwn) all.push_back({name, static_cast<double>((this->*count).load())});
  for (std::size_t i = 0; i < link_.size(); ++i)
    all.push_back({kOfTheLink[i].first, static_cast<double>(link_[i].load())});
  all.push_back({"current_a", current_a_});
  all.push_back({"voltage_v", voltage_v_});
  all.push_back({"temperature_c", temperature_c_});
  return all;
}

}  // namespace tankrig
