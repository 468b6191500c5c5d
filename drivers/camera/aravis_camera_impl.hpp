// State shared by an Aravis camera's reader and its keeper. For their two sources only.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "core/heartbeat.hpp"
#include "drivers/camera/aravis_link.hpp"
#include "drivers/camera/clock_trust.hpp"
#include "drivers/camera/frame_id.hpp"

namespace tankrig {

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
  /// Reads the device's clock until two readings agree, or one agrees with the line.
  Status read_clock(AravisLink& l, int tries, bool keep);
  /// Counts frames that nobody will take.
  void count_leftovers(AravisLink& l);
  Status start(AravisLink& l) {
    count_leftovers(l);
    return l.start();
  }

  // The keeper's thread.
  void keep();
  Duration look_after(const std::shared_ptr<AravisLink>& l, bool suspected);
  void settle_stop(AravisLink& l);
  void drop(std::shared_ptr<AravisLink> l);
  void reconnect();

  // The reader's thread.
  void take(AravisLink& l);
  std::optional<Frame> release(const AravisLink& l);
  void drop_held(std::uint64_t CameraCounters::*reason);
  // With the mutex.
  Frame frame(const AravisReceived& received, std::uint64_t sequence, const AravisLink& l);
  MappedStamp mid_exposure(const AravisReceived& received, Duration exposure);
  bool stalled(Stamp now, const AravisLink& l);

  const AravisSettings settings;
  MonotonicClock clock;

  mutable std::mutex mutex;  ///< all below, except the reader's own
  std::condition_variable wake;
  std::shared_ptr<AravisLink> link;
  bool running = false, stopping = false, poked = false, suspect = false;
  bool stop_owed = false;  ///< a stop is owed to a camera that may have gone: it would keep its reader waiting
  Heartbeat keeper_life;
  std::atomic<bool> latch{false};  ///< the device's clock can be asked
  ClockTrust trust;
  ArrivalEnvelope envelope;
  CameraCounters counters;
  std::uint64_t leftovers = 0;  ///< since the last start
  std::uint64_t short_frames = 0, late_frames = 0, restarts = 0, stalls = 0, disconnects = 0, reconnects = 0,
                stamps_by_arrival = 0;
  Duration round_trip{}, last_sigma{};
  AravisStreamCounts earlier;  ///< of connections that ended

  // The reader's thread only.
  struct Held {
    AravisReceived received;
    std::uint64_t sequence = 0, number = 0;  ///< the camera's, and of `trust`
    Stamp came{};
  };
  std::deque<Held> held;  ///< until the device's clock has been read
  FrameIdSequence ids;
  std::uint64_t generation = 0, seen_generation = 0, seen_underruns = 0, unnumbered = 0;
  Stamp last_news{};
  bool stall_told = false;

  std::thread keeper;
};

}  // namespace tankrig
