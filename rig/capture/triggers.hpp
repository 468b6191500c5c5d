// All triggered cameras of a scan: schedules in the cycle, one device thread each, and the fate of their triggers.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "rig/capture/scan_sink.hpp"
#include "rig/capture/trigger_record.hpp"
#include "rig/capture/trigger_schedule.hpp"
#include "rig/capture/trigger_thread.hpp"
#include "rig/executive/cycle_listener.hpp"

namespace tankrig {

/// Threads: cycle() in the cycle's, everything else in the supervisor's.
/// RT: cycle is safe.
///
/// Counts, under "CAMERA.REASON", where they are not 0:
///   trigger_dropped  the camera's thread was too busy for it
///   trigger_skipped  it was too late to ask for it
///   trigger_refused  the camera's driver refused it
///   trigger_unfired  the scan ended before it was due
class Triggers final : public CycleListener {
 public:
  Triggers(const ScanPlan& plan, const ScanSettings& settings, Clock& clock, ScanSink& sink)
      : plan_(plan), settings_(settings), clock_(clock), sink_(sink) {}

  /// Before begin(). `number` is the caller's for this camera; a free-running one is ignored.
  void add_camera(int number, Camera& camera, RecordWhen record, const TriggerSettings& trigger);
  void begin();
  void cycle(const CycleRecord& record) noexcept override;
  /// Under a virtual clock: fires what is due before the next cycle.
  void turn() noexcept;
  /// Collects what was fired since the last call. Returns what is wrong if a camera's thread is dead or stuck, else
  /// nothing.
  std::string collect();
  /// Since when this camera's triggers have brought no frame, if several are unanswered.
  std::optional<Stamp> unanswered_since(int number) const;
  void add_frame(int number, const Frame& frame);
  /// The camera was (re)started: earlier triggers bring no frame.
  void restarted(int number);
  /// After the last frame and the last cycle.
  void finish();
  /// The same without telling the sink, which takes nothing any more.
  void give_up();

  std::map<std::string, std::uint64_t> counts() const;
  /// Of a triggered camera, after finish().
  struct Account {
    std::uint64_t expected = 0;  ///< frames: those that were to be triggered, and those that came without a trigger
    std::uint64_t lost = 0;      ///< triggers given of which no frame came
  };
  Account account(int number) const;
  /// Per triggered camera: "CAMERA.trigger_delay_ms", "CAMERA.trigger_error_p99_ms", "CAMERA.triggers",
  /// "CAMERA.untriggered".
  Statistics statistics() const;

 private:
  struct One {
    One(int its_number, Camera& camera, const TriggerSettings& trigger, const ScanPlan& plan,
        const ScanSettings& settings, RecordWhen record_when, Clock& clock)
        : number(its_number),
          name(camera.info().name),
          delay_is_given(trigger.delay.has_value()),
          schedule(plan, settings, trigger, record_when, 1 / camera.info().rate_hz),
          thread(camera, clock) {}

    const int number;
    const std::string name;
    const bool delay_is_given;
    TriggerSchedule schedule;
    TriggerThread thread;
    TriggerRecord record;
    std::uint64_t fired = 0, refused = 0;
    std::atomic<std::uint64_t> requested{0}, dropped{0};
  };

  void collect(One& one, bool tell = true);
  void end_threads();
  void tell_lost(const One& one, std::uint64_t before);

  const ScanPlan& plan_;
  const ScanSettings& settings_;
  Clock& clock_;
  ScanSink& sink_;
  std::vector<std::unique_ptr<One>> cameras_;
};

}  // namespace tankrig
