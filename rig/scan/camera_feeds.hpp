// The cameras of a running scan: started for what they record, asked for frames, missed when silent.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "core/clock.hpp"
#include "drivers/camera/camera.hpp"
#include "rig/capture/beam_watch.hpp"
#include "rig/capture/frame_joiner.hpp"
#include "rig/capture/stamp_watch.hpp"
#include "rig/capture/triggers.hpp"
#include "rig/plan/scan_settings.hpp"
#include "rig/plan/trigger_settings.hpp"

namespace tankrig {

struct ScanCamera {
  Camera* camera = nullptr;
  RecordWhen record = RecordWhen::kAll;
  StripeInView beam_in_view = {};
  TriggerSettings trigger = {};
  Duration time_offset = {};  ///< t_camera - t_joints
};

/// A camera's frames so far.
struct CameraProgress {
  std::string name;
  std::uint64_t taken = 0;     ///< arrived here
  std::uint64_t left_out = 0;  ///< by its driver
};

/// What the feeds report to the scan.
struct CameraFeedEvents {
  std::function<void()> asks;        ///< a driver call that may take its time is next
  std::function<void(Stamp)> frame;  ///< one has arrived, before anybody else has it
  std::function<void(Stamp, const std::string& what)> dropped;
  std::function<void(const std::string& what, bool thread_died)> failed;
};

/// Frames go to the triggers, the beam watch and the joiner, in this order. The destructor stops the cameras.
/// Threads: one.
/// RT: never.
class CameraFeeds {
 public:
  CameraFeeds(const std::vector<ScanCamera>& cameras, const ScanSettings& settings, Clock& clock, FrameJoiner& joiner,
              Triggers& triggers, BeamWatch& beam, CameraFeedEvents tell);
  CameraFeeds(const CameraFeeds&) = delete;
  CameraFeeds& operator=(const CameraFeeds&) = delete;
  ~CameraFeeds();

  /// Starts the free-running camera that sets the frame grid of the passes. False: there is none.
  bool start_grid_camera();
  /// Starts and stops cameras as the plan wants them. `ended`: none is needed any more.
  void schedule(bool ended);
  /// A few frames of each running camera.
  void grab();
  /// Reports a camera that delivers nothing though its driver finds nothing wrong; a triggered one only if it is
  /// triggered.
  void check_silence();

  std::vector<CameraProgress> progress() const;

  void begin_round() { held_up_.clear(); }
  /// The last wait of this round that was too long: "camera mono: held the supervisor up for 412 ms"; empty: none.
  const std::string& held_up() const { return held_up_; }
  /// Closes the account of frames: adds the frames that drivers, triggers and this object lost to `counts`, as
  /// "CAMERA.REASON". Returns how many frames each camera should have brought:
  ///   triggered     those its schedule wanted, and those that came without a trigger
  ///   free-running  those that came or whose fate its driver knows, further gaps in the frames' numbers,
  ///                 and those due by its rate while it was silent
  /// Reasons: those of CameraCounters; clock_jump (StampWatch); trigger_lost, a trigger without a frame or a reason
  /// from the driver.
  std::map<std::string, std::uint64_t> close_account(std::map<std::string, std::uint64_t>& counts) const;

 private:
  struct Feed {
    Camera* camera = nullptr;
    int number = 0;  ///< of the joiner, the triggers and the beam watch
    RecordWhen record = RecordWhen::kAll;
    Duration time_offset{};  ///< subtracted from the stamp of every frame
    bool triggered = false, running = false;
    Stamp news{};           ///< when it was started, or its newest frame arrived
    bool delivers = false;  ///< has done so since it was started
    StampWatch stamps = {};
    CameraCounters before = {};  ///< of the driver, at the start of the scan
    std::uint64_t taken = 0, jumped = 0, abandoned = 0;
    std::uint64_t missed = 0;       ///< left out by the driver at a stop, though they were to be recorded
    std::uint64_t unexplained = 0;  ///< gaps in the numbers that the driver's counters do not explain; of finished runs
    // Since it was started.
    std::optional<Frame> last = std::nullopt;  ///< without its picture; its stamp is on the joints' clock
    std::uint64_t known_before = 0, known_at_last = 0, skipped = 0, unexplained_now = 0;
  };

  void start(Feed& feed);
  void stop(Feed& feed, bool ended);
  bool hand_on(Feed& feed, Frame& frame);
  void keep_account(Feed& feed, const Frame& frame);
  void grab(Feed& feed);
  void check_silence(const Feed& feed);
  void failed(const Feed& feed, const Error& error);
  void failed(const Feed& feed, const std::string& what, bool thread_died = false);
  template <class Call>
  std::invoke_result_t<Call> ask(const Feed& feed, Call call);

  const ScanSettings& settings_;
  Clock& clock_;
  FrameJoiner& joiner_;
  Triggers& triggers_;
  BeamWatch& beam_;
  const CameraFeedEvents tell_;
  std::vector<Feed> feeds_;
  std::string held_up_;
};

}  // namespace tankrig
