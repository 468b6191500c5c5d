// An Aravis camera's own thread: it reads the device's clock, and finds a camera that vanished.
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/input_error.hpp"
#include "drivers/camera/aravis_camera_impl.hpp"

namespace tankrig {
namespace {

constexpr int kFirstReadings = 8, kLaterReadings = 3, kReadingsOfAFrame = 1;
constexpr int kReadings = 5;                                         // that disagree, in a row
constexpr Duration kAgain = std::chrono::milliseconds(20);           // then a little later again
constexpr Duration kNarrow = std::chrono::microseconds(500);         // one sigma; a wider reading is made once more
constexpr Duration kFirstInterval = std::chrono::milliseconds(200);  // until the drift is known
constexpr std::size_t kFirstSamples = 6;
constexpr Duration kRetry = std::chrono::milliseconds(300);
constexpr Duration kLastReader = std::chrono::milliseconds(1);

}  // namespace

void AravisCamera::Impl::first_reading(AravisLink& l) {
  const bool read = read_clock(l, kFirstReadings, true).ok();
  const std::lock_guard lock(mutex);
  latch = read && trust.fit().samples() > 0;
}

Status AravisCamera::Impl::read_clock(AravisLink& l, int tries, bool keep) {
  for (int i = 1; i <= kReadings; ++i) {
    std::uint64_t newest = 0;
    {
      const std::lock_guard lock(mutex);
      newest = trust.newest();
    }
    const Result<std::optional<ClockSample>> reading = l.read_clock(tries);
    if (!reading) return reading.error();
    if (!reading.value()) return {};
    if (tries == 1 && i == 1 && reading.value()->sigma > kNarrow) continue;
    const std::lock_guard lock(mutex);
    round_trip = from_seconds(seconds(reading.value()->sigma) * std::sqrt(12.0));
    if (trust.add_reading(*reading.value(), newest, keep || i > 1)) return {};
  }
  return {};
}

void AravisCamera::Impl::count_leftovers(AravisLink& l) {
  const std::lock_guard lock(mutex);
  const AravisLink::Flushed left = l.flush();
  counters.unread += left.whole;
  counters.incomplete += left.torn;
  leftovers += left.whole + left.torn;
}

void AravisCamera::Impl::keep() {
  Stamp look_at = clock.now() + kFirstInterval;
  Duration pause = kFirstInterval;
  for (;;) {
    std::shared_ptr<AravisLink> l;
    bool suspected = false, in_doubt = false;
    {
      std::unique_lock lock(mutex);
      wake.wait_for(lock, pause, [this] { return stopping || poked; });
      if (stopping) return;
      poked = false;
      suspected = std::exchange(suspect, false);
      in_doubt = latch && trust.in_doubt();
      l = link;
    }
    if (!l) {
      reconnect();
      pause = kRetry;
      continue;
    }
    if (const Stamp now = clock.now(); suspected || now >= look_at)
      look_at = now + look_after(l, suspected);
    else if (in_doubt)
      (void)read_clock(*l, kReadingsOfAFrame,
                       false);  // one that fails is looked after in time, or its frames are told of
    if (current() == l)
      settle_stop(*l);
    else
      drop(std::move(l));
    const std::lock_guard lock(mutex);
    pause = std::max(Duration{}, look_at - clock.now());
    if (latch && trust.in_doubt()) pause = std::min(pause, kAgain);
  }
}

/// Reads the clock, which also shows that the camera is there. Takes the link away if it is not.
Duration AravisCamera::Impl::look_after(const std::shared_ptr<AravisLink>& l, bool suspected) {
  bool there = !l->control_lost();
  if (there && suspected) there = l->answers();
  if (there && latch)
    there = read_clock(*l, kLaterReadings, true).ok() || l->answers();
  else if (there && !suspected)
    there = l->answers();
  const std::lock_guard lock(mutex);
  if (!there) {
    link.reset();
    ++disconnects;
    trust.fit().reset();
    envelope.reset();
    return {};
  }
  return latch && trust.fit().samples() < kFirstSamples ? std::min(kFirstInterval, settings.clock_interval)
                                                        : settings.clock_interval;
}

/// The stop that the reader did not wait for, unless it has begun again meanwhile.
void AravisCamera::Impl::settle_stop(AravisLink& l) {
  const auto wanted = [this] {
    const std::lock_guard lock(mutex);
    return running;
  };
  {
    const std::lock_guard lock(mutex);
    if (!std::exchange(stop_owed, false) || running) return;
  }
  l.stop();
  if (wanted()) (void)start(l);
}

/// Ends a connection in this thread, however long its time-outs are.
void AravisCamera::Impl::drop(std::shared_ptr<AravisLink> l) {
  const AravisStreamCounts counts = l->counts();
  count_leftovers(*l);
  {
    const std::lock_guard lock(mutex);
    earlier.completed += counts.completed;
    earlier.failures += counts.failures;
    earlier.underruns += counts.underruns;
    earlier.resent += counts.resent;
    earlier.missing += counts.missing;
  }
  l->abandon();
  while (l.use_count() > 1) clock.sleep_until(clock.now() + kLastReader);
  l.reset();
}

void AravisCamera::Impl::reconnect() {
  std::shared_ptr<AravisLink> fresh;
  try {
    AravisSettings again = settings;
    again.discovery_timeout = std::min(settings.discovery_timeout, kRetry);
    fresh = std::make_shared<AravisLink>(again);
  } catch (const InputError&) {
    return;  // not back yet, or not yet ours
  }
  if (settings.use_latch) first_reading(*fresh);
  const auto wanted = [this] {
    const std::lock_guard lock(mutex);
    return running;
  };
  if (wanted() && !start(*fresh).ok()) return;
  {
    const std::lock_guard lock(mutex);
    link = fresh;
    ++reconnects;
    ++generation;
  }
  if (!wanted()) fresh->stop();  // its reader stopped meanwhile
}

}  // namespace tankrig
