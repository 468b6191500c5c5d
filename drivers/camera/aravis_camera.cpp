#include "drivers/camera/aravis_camera.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/camera/aravis_camera_impl.hpp"

namespace tankrig {
namespace {

constexpr Duration kArrivalSigma = std::chrono::milliseconds(5);     // of a stamp that is an arrival and nothing more
constexpr Duration kLongestTransfer = std::chrono::seconds(2);       // a mapped stamp further back is no stamp
constexpr Duration kInFlight = std::chrono::milliseconds(200);       // from the end of an exposure to its first packet
constexpr Duration kLeastStall = std::chrono::milliseconds(500);     // a camera may take that to begin
constexpr Duration kClockPatience = std::chrono::milliseconds(800);  // of a frame with a clock that does not answer

Duration hypot(Duration a, Duration b) {
  return Duration{std::llround(std::hypot(static_cast<double>(a.count()), static_cast<double>(b.count())))};
}

Error not_started(Stamp when) { return {ErrorCode::kNotReady, 0, when, "camera: not started"}; }
Error gone(Stamp when) { return {ErrorCode::kDisconnected, 0, when, "camera: vanished, searched for"}; }

}  // namespace

MappedStamp AravisCamera::Impl::mid_exposure(const AravisReceived& received, Duration exposure) {
  using StampAt = AravisSettings::StampAt;
  const Duration to_end = settings.stamp_at == StampAt::kExposureStart ? exposure
                          : settings.stamp_at == StampAt::kExposureEnd ? Duration{}
                                                                       : -settings.readout;
  const Stamp end_by_arrival = received.arrival - settings.transfer_delay;
  if (!latch)
    if (const auto sample = envelope.add(received.device_ns, end_by_arrival - to_end)) trust.fit().add(*sample);
  if (auto mapped = trust.fit().map(received.device_ns + (to_end - exposure / 2).count())) {
    mapped->sigma = hypot(mapped->sigma, latch ? trust.sigma() : settings.transfer_delay_sigma);
    const Stamp earliest = received.arrival - exposure - kLongestTransfer;
    const bool possible = mapped->stamp <= received.arrival + 5 * mapped->sigma && mapped->stamp >= earliest;
    // Late on its way, or its clock has jumped by as much: nobody can be asked.
    if (!latch) mapped->sigma = hypot(mapped->sigma, end_by_arrival - exposure / 2 - mapped->stamp);
    if (possible) return *mapped;
  }
  ++stamps_by_arrival;
  return {end_by_arrival - exposure / 2, hypot(kArrivalSigma, settings.transfer_delay_sigma)};
}

Frame AravisCamera::Impl::frame(const AravisReceived& received, std::uint64_t sequence, const AravisLink& l) {
  const MappedStamp mid = mid_exposure(received, l.exposure());
  last_sigma = mid.sigma;
  ++counters.delivered;
  return {received.image, mid.stamp, mid.sigma, l.exposure(), sequence};
}

/// Counts what has come; whole frames wait for their clock, no more of them than there are buffers.
void AravisCamera::Impl::take(AravisLink& l) {
  while (held.size() < static_cast<std::size_t>(settings.buffers)) {
    std::optional<AravisReceived> received = l.pop();
    if (!received) return;
    last_news = clock.now();
    stall_told = false;
    if (received->state != AravisReceived::State::kComplete) {
      ++unnumbered;  // without its leader a frame has no number
      const std::lock_guard lock(mutex);
      ++counters.incomplete;
      short_frames += received->state == AravisReceived::State::kShort;
      continue;
    }
    const FrameIdSequence::Step step = ids.next(received->id, unnumbered);
    unnumbered = 0;
    const std::uint64_t underruns = step.lost > 0 ? l.counts().underruns : seen_underruns;
    const std::lock_guard lock(mutex);
    (underruns > seen_underruns ? counters.overrun : counters.lost) += step.lost;
    seen_underruns = underruns;
    restarts += step.restarted;
    late_frames += step.late;
    if (step.late) continue;
    held.push_back({std::move(*received), step.sequence, trust.add_frame(), last_news});
    poked = true;
    wake.notify_all();
  }
}

/// The next frame whose stamp is known for sure, or as well as it can be without a latch.
std::optional<Frame> AravisCamera::Impl::release(const AravisLink& l) {
  const std::lock_guard lock(mutex);  // no reading comes between the word on a clock and the stamp that it gives
  for (; !held.empty(); held.pop_front()) {
    const Held& first = held.front();
    ClockTrust::Word word = ClockTrust::Word::kSure;
    if (latch) {
      word = trust.word(first.number, first.received.arrival - l.exposure() - kInFlight);
      counters.clock_unsure += word == ClockTrust::Word::kUnsure;
    }
    if (word == ClockTrust::Word::kWait) break;
    if (word == ClockTrust::Word::kUnsure) continue;
    const Held next = std::move(held.front());
    held.pop_front();
    return frame(next.received, next.sequence, l);
  }
  return std::nullopt;
}

void AravisCamera::Impl::drop_held(std::uint64_t CameraCounters::*reason) {
  const std::lock_guard lock(mutex);
  counters.*reason += held.size();
  held.clear();
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
  if (const Status started = m.start(*link); !started.ok()) return started;
  const std::lock_guard lock(m.mutex);
  m.running = true;
  m.stop_owed = false;
  m.ids.restart();  // what was exposed while nobody wanted it is not lost
  m.unnumbered = std::exchange(m.leftovers, 0);
  m.last_news = m.clock.now();
  m.stall_told = false;
  return {};
}

void AravisCamera::stop() noexcept {
  Impl& m = *impl_;
  std::shared_ptr<AravisLink> link;
  bool owed = false;
  m.drop_held(&CameraCounters::unread);
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
      m.counters.clock_unsure += m.held.size();
      m.held.clear();
      m.ids.restart();
      m.last_news = m.clock.now();
      m.stall_told = false;
    }
  }
  if (m.keeper_life.missing(m.clock.now()))
    return Error{ErrorCode::kInternal, 0, m.clock.now(), "camera: its thread is dead or stuck"};
  if (!link || link->control_lost()) {
    m.drop_held(&CameraCounters::clock_unsure);
    if (link) m.poke(true);
    return gone(m.clock.now());
  }
  m.take(*link);
  if (std::optional<Frame> frame = m.release(*link)) return frame;
  const Stamp now = m.clock.now();
  if (!m.held.empty() && now - m.held.front().came > kClockPatience) {
    m.drop_held(&CameraCounters::clock_unsure);
    m.poke(true);
    return Error{ErrorCode::kTimeout, 0, now, "camera: its clock does not answer"};
  }
  if (!m.stalled(now, *link)) return std::optional<Frame>{};
  m.poke(true);
  const std::lock_guard lock(m.mutex);
  ++m.stalls;
  return Error{ErrorCode::kTimeout, 0, now, "camera: no frames"};
}

CameraCounters AravisCamera::counters() const {
  Impl& m = *impl_;
  std::shared_ptr<AravisLink> stopped;
  {
    const std::lock_guard lock(m.mutex);
    if (!m.running) stopped = m.link;
  }
  if (stopped) m.count_leftovers(*stopped);
  const std::lock_guard lock(m.mutex);
  return m.counters;
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
          {"unread", number(m.counters.unread)},
          {"clock_unsure", number(m.counters.clock_unsure)},
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
          {"clock_drift_ppm", m.trust.fit().drift_ppm()},
          {"clock_drift_sigma_ppm", m.trust.fit().drift_sigma_ppm()},
          {"clock_samples", number(m.trust.fit().samples())},
          {"clock_outliers", number(m.trust.fit().outliers())},
          {"clock_jumps", number(m.trust.fit().jumps())},
          {"stamps_by_arrival", number(m.stamps_by_arrival)},
          {"stamp_sigma_us", us(m.last_sigma)}};
}

}  // namespace tankrig
