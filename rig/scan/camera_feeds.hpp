// The cameras of a running scan: started for what they record, asked for their frames, missed when they are silent.
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

/// What the feeds tell whoever runs the scan.
struct CameraFeedEvents {
  std::function<void()> asks;        ///< a driver is about to be asked for what may take its time
  std::function<void(Stamp)> frame;  ///< one has come, before anybody else has it
  std::function<void(const std::string& what, bool thread_died)> failed;
};

/// Frames go to the triggers, the beam watch and the joiner, in this order.  Threads: one.  RT: never.
/// However it is left, the cameras are stopped.
class CameraFeeds {
 public:
  CameraFeeds(const std::vector<ScanCamera>& cameras, const ScanSettings& settings, Clock& clock, FrameJoiner& joiner,
              Triggers& triggers, BeamWatch& beam, CameraFeedEvents tell);
  CameraFeeds(const CameraFeeds&) = delete;
  CameraFeeds& operator=(const CameraFeeds&) = delete;
  ~CameraFeeds();

  /// Starts the free-running camera whose frames the passes are interleaved on. False: there is none.
  bool start_grid_camera();
  /// Starts and stops cameras as the plan wants them. `ended`: none is wanted any more.
  void schedule(bool ended);
  /// A few frames of each running camera.
  void grab();
  /// Tells of a camera that delivers nothing though its driver finds nothing wrong; of a triggered one, though it is
  /// triggered.
  void check_silence();

  void begin_round() { held_up_.clear(); }
  /// What was waited for too long, last in this round: "camera mono: held the supervisor up for 412 ms"; empty:
  /// nothing.
  const std::string& held_up() const { return held_up_; }
  /// Frames the drivers lost, "CAMERA.incomplete", "CAMERA.overrun".
  std::map<std::string, std::uint64_t> counts() const;

 private:
  struct Feed {
    Camera* camera;
    int number;  // of the joiner, the triggers and the beam watch
    RecordWhen record;
    Duration time_offset;  // taken off the stamp of every frame
    bool triggered;
    bool running;
    Stamp news;     // it was started, or its newest frame arrived
    bool delivers;  // has done so since it was started
    StampWatch stamps;
  };

  void start(Feed& feed);
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
