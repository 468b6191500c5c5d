// One connection to an open camera: its features, its stream, its frame memory. Ends when the camera vanishes.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.hpp"
#include "drivers/camera/aravis_camera.hpp"
#include "drivers/camera/aravis_object.hpp"
#include "drivers/camera/aravis_pixels.hpp"
#include "drivers/camera/clock_fit.hpp"

namespace tankrig {

/// What came off the wire.
struct AravisReceived {
  enum class State { kComplete, kIncomplete, kShort };
  State state = State::kComplete;
  std::uint64_t id = 0;
  std::int64_t device_ns = 0;
  Stamp arrival{};  ///< of the first packet
  cv::Mat image;    ///< only if complete
};

struct AravisStreamCounts {
  std::uint64_t completed = 0, failures = 0, underruns = 0, resent = 0, missing = 0;
};

/// Threads: start, stop, trigger, pop and read_clock may be called from different threads.
class AravisLink {
 public:
  /// Opens, sets every feature, reads exposure and rate back.
  /// Errors: InputError, naming the feature.
  explicit AravisLink(const AravisSettings& settings);
  ~AravisLink();
  AravisLink(const AravisLink&) = delete;
  AravisLink& operator=(const AravisLink&) = delete;

  Status start();
  void stop() noexcept;
  Status trigger();
  std::optional<AravisReceived> pop();
  struct Flushed {
    std::uint64_t whole = 0, torn = 0;
  };
  /// Discards frames that have come and were not popped.
  Flushed flush() noexcept;

  /// The device's clock between two readings of ours, the narrowest of `tries`. Nothing: the device has no latch.
  /// Errors: kDisconnected if it does not answer.
  Result<std::optional<ClockSample>> read_clock(int tries);
  /// Whether the device can be reached; asks on the wire.
  bool answers() const;
  /// The device took our control away, or does not answer its heartbeat.
  bool control_lost() const noexcept { return control_lost_; }
  /// Keeps the destructor from waiting for a camera that is gone.
  void abandon() noexcept { abandoned_ = true; }

  Duration exposure() const noexcept { return exposure_; }
  double rate_hz() const noexcept { return rate_hz_; }
  bool extended_ids() const noexcept { return extended_ids_; }
  bool packet_socket() const noexcept { return packet_socket_; }
  int packet_size() const noexcept { return packet_size_; }
  AravisStreamCounts counts() const;

 private:
  struct Slot;
  void configure();
  void set_pixel_format();
  void set_region();
  void set_exposure();
  void set_timing();
  void read_back();
  void open_stream();
  void add_buffer();
  /// Orders us and the stream's thread whenever a slot changes hands. Aravis' queues do so too, but inside a library
  /// that thread checkers cannot see into.
  void hand_over() noexcept { handed_over_.fetch_add(1, std::memory_order_acq_rel); }
  cv::Mat free_memory();
  std::int64_t device_stamp(ArvBuffer* buffer) const;
  ArvDevice* device() const { return arv_camera_get_device(camera_.get()); }
  [[noreturn]] void refuse(const std::string& what, const ArvError& error) const;
  void feature(const char* name, const std::string& value, const std::function<void(GError**)>& set) const;

  AravisSettings settings_;
  MonotonicClock clock_;
  AravisPixels pixels_;
  // What Aravis' threads touch lives longer than camera and stream.
  std::atomic<bool> control_lost_{false}, abandoned_{false};
  std::atomic<unsigned> handed_over_{0};
  ArvPtr<ArvCamera> camera_;
  ArvPtr<ArvStream> stream_;
  ArvPtr<ArvChunkParser> chunks_;
  std::mutex features_;  ///< GenICam nodes are not for two threads
  std::mutex memory_mutex_;
  std::vector<cv::Mat> memory_;  ///< frame memory; ours alone where nobody reads the picture any more
  std::size_t payload_ = 0;
  Duration exposure_{};
  double rate_hz_ = 0, ns_per_tick_ = 0;
  bool gige_ = false, extended_ids_ = false, packet_socket_ = false;
  int packet_size_ = 0;
  std::string address_;
  bool acquiring_ = false;
  gulong lost_handler_ = 0;
};

}  // namespace tankrig
