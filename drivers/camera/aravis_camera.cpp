#include "drivers/camera/aravis_camera.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "core/input_error.hpp"
#include "core/sign_of_life.hpp"
#include "drivers/camera/aravis_link.hpp"
#include "drivers/camera/frame_id.hpp"

namespace tankrig {
namespace {

constexpr int kFirstReadings = 8, kLaterReadings = 3;
constexpr Duration kFirstInterval = std::chrono::milliseconds(200);  // until the drift is known
constexpr std::size_t kFirstSamples = 6;
constexpr Duration kRetry = std::chrono::milliseconds(300);
constexpr Duration kArrivalSigma = std::chrono::milliseconds(5);  // of a stamp that is an arrival and nothing more
constexpr Duration kLongestTransfer = std::chrono::seconds(2);    // a mapped stamp further back is no stamp
constexpr Duration kLeastStall = std::chrono::milliseconds(500);  // a camera may take that to begin
constexpr Duration kLastReader = std::chrono::milliseconds(1);

Duration hypot(Duration a, Duration b) {
  return Duration{std::llround(std::hypot(static_cast<double>(a.count()), static_cast<double>(b.count())))};
}

Error not_started(Stamp when) { return {ErrorCode::kNotReady, 0, when, "camera: not started"}; }
Error gone(Stamp when) { return {ErrorCode::kDisconnected, 0, when, "camera: vanished, searched for"}; }

}  // namespace

struct AravisCamera::Impl {
  explicit Impl(const AravisSettings& s) : settings(s), link(std::make_shared<AravisLink>(s)) {
    if (s.use_latch) first_reading(*link);
    ids = sequence_for(*link);
    keeper = std::thread([this] {
      try {
        keep();
      } catch (...) {
        keeper_life.end();
      }
    });
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
    }
    wake.notify_all();
    keeper.join();
  }

  static FrameIdSequence sequence_for(const AravisLink& l) {
    return FrameIdSequence(l.extended_ids() ? FrameIdSequence::Width::k64 : FrameIdSequence::Width::k16);
  }

  std::shared_ptr<AravisLink> current() const {
    const std::lock_guard lock(mutex);
    return link;
  }

  void poke(bool suspicion) {
    {
      const std::lock_guard lock(mutex);
      poked = true;
      suspect = suspect || suspicion;
    }
    wake.notify_all();
  }

  void first_reading(AravisLink& l);
  Status read_clock(AravisLink& l, int tries);

  // The keeper's thread.
  void keep();
  Duration look_after(const std::shared_ptr<AravisLink>& l, bool suspected);
  void settle_stop(AravisLink& l);
  void drop(std::shared_ptr<AravisLink> l);
  void reconnect();

  // The reader's thread.
  Frame frame(const AravisReceived& received, const FrameIdSequence::Step& step, const AravisLink& l);
  MappedStamp mid_exposure(const AravisReceived& received, Duration exposure);
  bool stalled(Stamp now, const AravisLink& l);

  const AravisSettings settings;
  MonotonicClock clock;

  mutable std::mutex mutex;  ///< all below, except the reader's own
  std::condition_variable wake;
  std::shared_ptr<AravisLink> link;
  bool running = false, stopping = false, poked = false, suspect = false;
  bool stop_owed = false;  ///< to a camera that may have gone: it would keep its reader waiting
  SignOfLife keeper_life;
  std::atomic<bool> latch{false};  ///< the device's clock can be asked
  ClockFit fit;
  ArrivalEnvelope envelope;
  CameraCounters counters;
  std::uint64_t short_frames = 0, late_frames = 0, restarts = 0, stalls = 0, disconnects = 0, reconnects = 0,
                stamps_by_arrival = 0;
  Duration round_trip{}, last_sigma{};
  AravisStreamCounts earlier;  ///< of connections that ended

  // The reader's thread only.
  FrameIdSequence ids;
  std::uint64_t generation = 0, seen_generation = 0, seen_underruns = 0, unnumbered = 0;
  Stamp last_news{};
  bool stall_told = false;

  std::thread keeper;
};

void AravisCamera::Impl::first_reading(AravisLink& l) {
  const bool read = read_clock(l, kFirstReadings).ok();
  const std::lock_guard lock(mutex);
  latch = read && fit.samples() > 0;
}

Status AravisCamera::Impl::read_clock(AravisLink& l, int tries) {
  const Result<std::optional<ClockSample>> reading = l.read_clock(tries);
  if (!reading) return reading.error();
  if (!reading.value()) return {};
  const std::lock_guard lock(mutex);
  fit.add(*reading.value());
  round_trip = from_seconds(seconds(reading.value()->sigma) * std::sqrt(12.0));
  return {};
}

void AravisCamera::Impl::keep() {
  Duration pause = kFirstInterval;
  for (;;) {
    std::shared_ptr<AravisLink> l;
    bool suspected = false;
    {
      std::unique_lock lock(mutex);
      wake.wait_for(lock, pause, [this] { return stopping || poked; });
      if (stopping) return;
      poked = false;
      suspected = std::exchange(suspect, false);
      l = link;
    }
    if (l) {
      pause = look_after(l, suspected);
      if (current() == l)
        settle_stop(*l);
      else
        drop(std::move(l));
    } else {
      reconnect();
      pause = kRetry;
    }
  }
}

/// Reads the clock, which also shows that the camera is there. Takes the link away if it is not.
Duration AravisCamera::Impl::look_after(const std::shared_ptr<AravisLink>& l, bool suspected) {
  bool there = !l->control_lost();
  if (there && suspected) there = l->answers();
  if (there && latch)
    there = read_clock(*l, kLaterReadings).ok() || l->answers();
  else if (there && !suspected)
    there = l->answers();
  const std::lock_guard lock(mutex);
  if (!there) {
    link.reset();
    ++disconnects;
    fit.reset();
    envelope.reset();
    return {};
  }
  return latch && fit.samples() < kFirstSamples ? std::min(kFirstInterval, settings.clock_interval)
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
  if (wanted()) (void)l.start();
}

/// Ends a connection in this thread, however long its time-outs are.
void AravisCamera::Impl::drop(std::shared_ptr<AravisLink> l) {
  const AravisStreamCounts counts = l->counts();
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
  if (wanted() && !fresh->start().ok()) return;
  {
    const std::lock_guard lock(mutex);
    link = fresh;
    ++reconnects;
    ++generation;
  }
  if (!wanted()) fresh->stop();  // its reader stopped meanwhile
}

MappedStamp AravisCamera::Impl::mid_exposure(const AravisReceived& received, Duration exposure) {
  using StampAt = AravisSettings::StampAt;
  const Duration to_end = settings.stamp_at == StampAt::kExposureStart ? exposure
                          : settings.stamp_at == StampAt::kExposureEnd ? Duration{}
                                                                       : -settings.readout;
  const Stamp end_by_arrival = received.arrival - settings.transfer_delay;
  const std::lock_guard lock(mutex);
  if (!latch)
    if (const auto sample = envelope.add(received.device_ns, end_by_arrival - to_end)) fit.add(*sample);
  if (auto mapped = fit.map(received.device_ns + (to_end - exposure / 2).count())) {
    if (!latch) mapped->sigma = hypot(mapped->sigma, settings.transfer_delay_sigma);
    const Stamp earliest = received.arrival - exposure - kLongestTransfer;
    if (mapped->stamp <= received.arrival + 5 * mapped->sigma && mapped->stamp >= earliest) return *mapped;
  }
  ++stamps_by_arrival;
  return {end_by_arrival - exposure / 2, hypot(kArrivalSigma, settings.transfer_delay_sigma)};
}

Frame AravisCamera::Impl::frame(const AravisReceived& received, const FrameIdSequence::Step& step,
                                const AravisLink& l) {
  const std::uint64_t before = stamps_by_arrival;
  const MappedStamp mid = mid_exposure(received, l.exposure());
  if (latch && stamps_by_arrival != before) poke(false);
  const std::lock_guard lock(mutex);
  last_sigma = mid.sigma;
  ++counters.delivered;
  return {received.image, mid.stamp, mid.sigma, l.exposure(), step.sequence};
}

bool AravisCamera::Impl::stalled(Stamp now, const AravisLink& l) {
  if (settings.trigger != "off" || stall_told) return false;
  const Duration period = std::max(from_seconds(1 / l.rate_hz()), l.exposure());
  stall_told = now - last_news > std::max(period * settings.stall_periods, kLeastStall);
  return stall_told;
}

AravisCamera::AravisCamera(const AravisSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
AravisCamera::~AravisCamera() = default;

CameraInfo AravisCamera::info() const { return impl_->settings.info; }

Status AravisCamera::start() {
  Impl& m = *impl_;
  const std::shared_ptr<AravisLink> link = m.current();
  if (!link) return gone(m.clock.now());
  if (const Status started = link->start(); !started.ok()) return started;
  const std::lock_guard lock(m.mutex);
  m.running = true;
  m.stop_owed = false;
  m.ids.restart();  // what was exposed while nobody wanted it is not lost
  m.unnumbered = 0;
  m.last_news = m.clock.now();
  m.stall_told = false;
  return {};
}

void AravisCamera::stop() noexcept {
  Impl& m = *impl_;
  std::shared_ptr<AravisLink> link;
  bool owed = false;
  {
    const std::lock_guard lock(m.mutex);
    m.running = false;
    link = m.link;
    owed = m.stop_owed = link && (m.stall_told || link->control_lost());
  }
  if (owed)
    m.poke(true);
  else if (link)
    link->stop();
}

Status AravisCamera::trigger() {
  Impl& m = *impl_;
  if (m.settings.trigger != "software") return Camera::trigger();
  std::shared_ptr<AravisLink> link;
  {
    const std::lock_guard lock(m.mutex);
    if (!m.running) return not_started(m.clock.now());
    link = m.link;
  }
  if (!link) return gone(m.clock.now());
  return link->trigger();
}

Result<std::optional<Frame>> AravisCamera::try_grab() {
  Impl& m = *impl_;
  std::shared_ptr<AravisLink> link;
  {
    const std::lock_guard lock(m.mutex);
    if (!m.running) return not_started(m.clock.now());
    link = m.link;
    if (m.generation != m.seen_generation) {
      m.seen_generation = m.generation;
      m.seen_underruns = 0;
      m.ids.restart();
      m.last_news = m.clock.now();
      m.stall_told = false;
    }
  }
  if (m.keeper_life.missing(m.clock.now()))
    return Error{ErrorCode::kInternal, 0, m.clock.now(), "camera: its thread is dead or stuck"};
  if (!link) return gone(m.clock.now());
  if (link->control_lost()) {
    m.poke(true);
    return gone(m.clock.now());
  }
  while (const std::optional<AravisReceived> received = link->pop()) {
    m.last_news = m.clock.now();
    m.stall_told = false;
    if (received->state != AravisReceived::State::kComplete) {
      ++m.unnumbered;  // without its leader a frame has no number
      const std::lock_guard lock(m.mutex);
      ++m.counters.incomplete;
      m.short_frames += received->state == AravisReceived::State::kShort;
      continue;
    }
    const FrameIdSequence::Step step = m.ids.next(received->id, m.unnumbered);
    m.unnumbered = 0;
    const std::uint64_t underruns = step.lost > 0 ? link->counts().underruns : m.seen_underruns;
    {
      const std::lock_guard lock(m.mutex);
      (underruns > m.seen_underruns ? m.counters.overrun : m.counters.lost) += step.lost;
      m.seen_underruns = underruns;
      m.restarts += step.restarted;
      m.late_frames += step.late;
    }
    if (!step.late) return std::optional<Frame>(m.frame(*received, step, *link));
  }
  const Stamp now = m.clock.now();
  if (!m.stalled(now, *link)) return std::optional<Frame>{};
  m.poke(true);
  const std::lock_guard lock(m.mutex);
  ++m.stalls;
  return Error{ErrorCode::kTimeout, 0, now, "camera: no frames"};
}

CameraCounters AravisCamera::counters() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->counters;
}

Statistics AravisCamera::statistics() const {
  const Impl& m = *impl_;
  const std::shared_ptr<AravisLink> link = m.current();
  AravisStreamCounts now;
  if (link) now = link->counts();
  const std::lock_guard lock(m.mutex);
  const auto number = [](auto v) { return static_cast<double>(v); };
  const auto us = [](Duration d) { return seconds(d) * 1e6; };
  return {{"delivered", number(m.counters.delivered)},
          {"lost", number(m.counters.lost)},
          {"incomplete", number(m.counters.incomplete)},
          {"overrun", number(m.counters.overrun)},
          {"short_frames", number(m.short_frames)},
          {"late_frames", number(m.late_frames)},
          {"frame_id_restarts", number(m.restarts)},
          {"stalls", number(m.stalls)},
          {"disconnects", number(m.disconnects)},
          {"reconnects", number(m.reconnects)},
          {"stream_completed", number(m.earlier.completed + now.completed)},
          {"stream_failures", number(m.earlier.failures + now.failures)},
          {"stream_underruns", number(m.earlier.underruns + now.underruns)},
          {"packets_resent", number(m.earlier.resent + now.resent)},
          {"packets_missing", number(m.earlier.missing + now.missing)},
          {"packet_size_bytes", number(link ? link->packet_size() : 0)},
          {"packet_socket", number(link && link->packet_socket())},
          {"timestamp_latch", number(m.latch.load())},
          {"latch_round_trip_us", us(m.round_trip)},
          {"clock_drift_ppm", m.fit.drift_ppm()},
          {"clock_drift_sigma_ppm", m.fit.drift_sigma_ppm()},
          {"clock_samples", number(m.fit.samples())},
          {"clock_outliers", number(m.fit.outliers())},
          {"clock_jumps", number(m.fit.jumps())},
          {"stamps_by_arrival", number(m.stamps_by_arrival)},
          {"stamp_sigma_us", us(m.last_sigma)}};
}

}  // namespace tankrig
