#include "rig/capture/triggers.hpp"

#include "session/recording/event_kinds.hpp"

namespace tankrig {

void Triggers::add_camera(int number, Camera& camera, RecordWhen record, const TriggerSettings& trigger) {
  if (trigger.mode == TriggerMode::kFree) return;
  cameras_.push_back(std::make_unique<One>(number, camera, trigger, plan_, settings_, record, clock_));
}

void Triggers::begin() {
  for (const auto& one : cameras_) one->thread.begin();
}

void Triggers::cycle(const CycleRecord& record) noexcept {
  for (const auto& one : cameras_)
    if (const auto request = one->schedule.next(record)) {
      one->requested.fetch_add(1, std::memory_order_relaxed);
      if (!one->thread.request(*request)) one->dropped.fetch_add(1, std::memory_order_relaxed);
    }
}

void Triggers::turn() noexcept {
  if (clock_.real_time()) return;
  const Stamp end = clock_.now() + from_seconds(1 / settings_.cycle_hz);
  while (true) {
    One* first = nullptr;
    Stamp when = end;
    for (const auto& one : cameras_)
      if (const auto due = one->thread.due(); due && *due < when) first = one.get(), when = *due;
    if (!first) return;
    first->thread.fire_due();
  }
}

void Triggers::collect(One& one, bool tell) {
  FiredTrigger fired;
  while (one.thread.try_pop(fired)) {
    ++one.fired;
    if (fired.accepted) {
      one.record.add(fired);
      continue;
    }
    ++one.refused;
    if (tell) sink_.event(fired.fired, event_kind::kDrop, one.name + ": trigger_refused: " + describe(fired.error));
  }
  const std::uint64_t lost = one.record.lost();
  one.record.settle(clock_.now());
  if (tell) tell_lost(one, lost);
  if (const auto delay = one.record.delay(); delay && !one.delay_is_given) one.schedule.set_delay(*delay);
}

void Triggers::tell_lost(const One& one, std::uint64_t before) {
  if (const std::uint64_t now = one.record.lost(); now > before)
    sink_.event(clock_.now(), event_kind::kDrop, one.name + ": trigger_lost x " + std::to_string(now - before));
}

void Triggers::restarted(int number) {
  for (const auto& one : cameras_) {
    if (one->number != number) continue;
    collect(*one);
    const std::uint64_t lost = one->record.lost();
    one->record.finish();
    tell_lost(*one, lost);
  }
}

std::string Triggers::collect() {
  std::string dead;
  for (const auto& one : cameras_) {
    collect(*one);
    if (dead.empty() && one->thread.dead()) dead = "camera " + one->name + ": its trigger thread is dead or stuck";
  }
  return dead;
}

std::optional<Stamp> Triggers::unanswered_since(int number) const {
  for (const auto& one : cameras_)
    if (one->number == number) return one->record.unanswered_since();
  return std::nullopt;
}

void Triggers::add_frame(int number, const Frame& frame) {
  for (const auto& one : cameras_)
    if (one->number == number) one->record.add_frame(frame.stamp, frame.exposure);
}

void Triggers::finish() {
  end_threads();
  for (const auto& one : cameras_) {
    collect(*one);
    const std::uint64_t lost = one->record.lost();
    one->record.finish();
    tell_lost(*one, lost);
  }
}

void Triggers::give_up() {
  end_threads();
  for (const auto& one : cameras_) {
    collect(*one, false);
    one->record.finish();
  }
}

void Triggers::end_threads() {
  for (const auto& one : cameras_)
    if (!one->thread.dead()) one->thread.end();
}

std::map<std::string, std::uint64_t> Triggers::counts() const {
  std::map<std::string, std::uint64_t> counts;
  const auto add = [&](const One& one, const char* reason, std::uint64_t count) {
    if (count > 0) counts[one.name + "." + reason] = count;
  };
  for (const auto& one : cameras_) {
    add(*one, "trigger_dropped", one->dropped.load(std::memory_order_relaxed));
    add(*one, "trigger_refused", one->refused);
    add(*one, "trigger_skipped", one->schedule.skipped());
    add(*one, "trigger_unfired", one->requested - one->dropped - one->fired);
  }
  return counts;
}

Triggers::Account Triggers::account(int number) const {
  for (const auto& one : cameras_)
    if (one->number == number)
      return {one->schedule.skipped() + one->requested + one->record.untriggered(), one->record.lost()};
  return {};
}

Statistics Triggers::statistics() const {
  Statistics out;
  for (const auto& one : cameras_) {
    out.push_back({one->name + ".triggers", static_cast<double>(one->fired)});
    out.push_back({one->name + ".untriggered", static_cast<double>(one->record.untriggered())});
    out.push_back({one->name + ".trigger_delay_ms", 1e3 * seconds(one->record.delay().value_or(Duration{0}))});
    out.push_back({one->name + ".trigger_error_p99_ms", 1e3 * one->record.timing_error(0.99)});
  }
  return out;
}

}  // namespace tankrig
