#include "sim_backends/wire/gige_exposures.hpp"

#include <algorithm>
#include <chrono>

#include "core/clock.hpp"

namespace tankrig::sim {

using namespace gige_register;

void GigeExposures::written(std::uint32_t address, std::uint32_t value, Stamp arrival) {
  const std::lock_guard lock(mutex_);
  if (address == kTriggerSoftware) {
    if (value == 0) return;
    const bool armed = acquiring_ && software_triggered();
    if (!armed || arrival < exposing_until_ || triggers_.size() >= kMostTriggers) {
      ++counts_.ignored;
      return;
    }
    exposing_until_ = arrival + exposure();
    triggers_.push_back(arrival);
    wake_.notify_all();
    return;
  }
  const bool acquiring = registers_.get(kAcquisition) != 0 && registers_.get(kControlPrivilege) != 0;
  if (acquiring == acquiring_ && address != kTriggerMode && address != kTriggerSource && address != kFramePeriodUs)
    return;
  if (acquiring != acquiring_) ++acquisition_;
  acquiring_ = acquiring;
  counts_.ignored += triggers_.size();
  triggers_.clear();
  exposing_until_ = arrival;
  last_on_grid_.reset();
  ++changes_;
  wake_.notify_all();
}

std::optional<GigeExposures::Exposure> GigeExposures::next() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    const std::uint64_t known = changes_;
    std::optional<Exposure> exposure;
    if (acquiring_ && free_running())
      exposure = on_grid(lock);
    else if (acquiring_ && !triggers_.empty())
      exposure = triggered(lock);
    else
      wake_.wait(lock, [&] { return ending_ || changes_ != known || !triggers_.empty(); });
    if (exposure) return exposure;
  }
  return std::nullopt;
}

bool GigeExposures::wanted(const Exposure& exposure) const {
  const std::lock_guard lock(mutex_);
  return acquiring_ && exposure.acquisition == acquisition_;
}

void GigeExposures::end() {
  const std::lock_guard lock(mutex_);
  ending_ = true;
  ++changes_;
  wake_.notify_all();
}

bool GigeExposures::software_triggered() const {
  return registers_.get(kTriggerMode) == 1 && registers_.get(kTriggerSource) == 1;
}

bool GigeExposures::free_running() const {
  return registers_.get(kTriggerMode) == 0 && registers_.get(kFramePeriodUs) > 0;
}

Duration GigeExposures::exposure() const { return std::chrono::microseconds(registers_.get(kExposureUs)); }

bool GigeExposures::reached(std::unique_lock<std::mutex>& lock, Stamp when) {
  const std::uint64_t known = changes_;
  const std::chrono::steady_clock::time_point deadline{Duration{when.ns}};  // CLOCK_MONOTONIC, as Stamp
  return !wake_.wait_until(lock, deadline, [&] { return changes_ != known; });
}

std::optional<GigeExposures::Exposure> GigeExposures::triggered(std::unique_lock<std::mutex>& lock) {
  const Stamp begin = triggers_.front();
  const Duration length = exposure();
  if (!reached(lock, begin + length)) return std::nullopt;
  triggers_.pop_front();
  return made(begin, length);
}

std::optional<GigeExposures::Exposure> GigeExposures::on_grid(std::unique_lock<std::mutex>& lock) {
  const Duration period = std::chrono::microseconds(registers_.get(kFramePeriodUs));
  const Duration length = exposure();
  const Stamp earliest = std::max(MonotonicClock{}.now(), exposing_until_ + length);
  const std::int64_t end = earliest.ns / period.count() + 1;
  if (!reached(lock, {end * period.count()})) return std::nullopt;
  if (last_on_grid_ && end > *last_on_grid_ + 1) {
    const auto passed = static_cast<std::uint64_t>(end - *last_on_grid_ - 1);
    counts_.skipped += passed;
    counts_.next_index += passed;
  }
  last_on_grid_ = end;
  return made(Stamp{end * period.count()} - length, length);
}

GigeExposures::Exposure GigeExposures::made(Stamp begin, Duration length) {
  ++counts_.made;
  return {counts_.next_index++, begin, length, acquisition_};
}

}  // namespace tankrig::sim
