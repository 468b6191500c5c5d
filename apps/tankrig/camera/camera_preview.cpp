// `tankrig camera preview`: without the laser a camera alone; with it, under the executive, the arm held at rest.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/tankrig/arm/arm_motion.hpp"
#include "apps/tankrig/camera/camera_preview_output.hpp"
#include "apps/tankrig/camera/preview_drawer.hpp"
#include "apps/tankrig/command_line/commissioned.hpp"
#include "apps/tankrig/command_line/confirm.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/start_warning.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/command_line/waiting.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/backend.hpp"
#include "core/input_error.hpp"
#include "rig/capture/beam_view.hpp"
#include "rig/plan/light_check.hpp"
#include "rig/plan/operator_plan.hpp"
#include "rig/scan/before_start.hpp"
#include "rig/scan/scan.hpp"
#include "rig/scan/scan_log.hpp"
#include "session/recording/event_kinds.hpp"

namespace tankrig::app {
namespace {

struct CameraPreviewOptions {
  std::string rig = "tank-sim";               ///< name below etc/rigs, or a path to a rig.yaml
  std::string camera;                         ///< empty: the rig file's first
  std::filesystem::path out = "preview.png";  ///< refreshed in place; the page that shows it lies beside it
  std::optional<double> seconds;              ///< nothing: until Ctrl-C, or what a virtual clock or the laser allows
  double rate_hz = 5;                         ///< refreshes per second, at most
  std::vector<std::string> waived;            ///< "commission"
  bool laser = false, yes = false, json = false;
};

/// Longest time that the laser stays on for one preview [s].
inline constexpr double kLongestLitPreview = 120;

using namespace std::chrono_literals;

constexpr double kVirtualSeconds = 2, kLitSeconds = 30;
constexpr int kDarkFrames = 5;  // for the stripe's background
constexpr int kFramesPerRound = 4;
constexpr Duration kRetry = 1s, kSilence = 2s, kLongestSleep = 20ms, kFirstFrame = 5s;

struct CameraChoice {
  Camera* device;
  const RigCamera* rig;
};

const RigCamera& choose_camera(const RigConfig& rig, const std::string& name) {
  std::string known;
  for (const RigCamera& camera : rig.cameras) {
    if (name.empty() || camera.name == name) return camera;
    known += (known.empty() ? "" : ", ") + camera.name;
  }
  throw InputError("--camera: found '" + name + "', expected one of: " + known);
}

/// One camera for as long as it is wanted. What fails is told once; a driver finds its own camera again, and one that
/// could not be started is tried again every second.
class FreePreview {
 public:
  FreePreview(Camera& camera, Clock& clock, PreviewOutput& output, Progress& progress)
      : camera_(camera), clock_(clock), output_(output), progress_(progress) {}
  ~FreePreview() { camera_.stop(); }
  FreePreview(const FreePreview&) = delete;
  FreePreview& operator=(const FreePreview&) = delete;

  void run(double seconds_long) {
    const Stamp begin = clock_.now();
    retry_at_ = last_news_ = begin;
    while (!StopOnSignal::requested() && seconds(clock_.now() - begin) < seconds_long) {
      if (!running_ && clock_.now() >= retry_at_) start();
      if (running_) grab();
      if (running_ && clock_.now() - last_news_ > kSilence) complain("no frame for 2 s");
      const Stamp soon = clock_.now() + kLongestSleep;
      clock_.sleep_until(running_ ? std::min(soon, camera_.next_frame_at().value_or(clock_.now() + 2ms)) : soon);
    }
  }

  /// The last failure in words; empty if the camera is well.
  const std::string& failure() const { return failure_; }

 private:
  void start() {
    const Status started = camera_.start();
    running_ = started.ok();
    if (running_) return;
    retry_at_ = clock_.now() + kRetry;
    complain(describe(started.error()));
  }

  /// A camera that takes longer for a frame than it takes to come must not keep the loop.
  void grab() {
    std::optional<Frame> newest;
    for (int frames = 0; frames < kFramesPerRound; ++frames) {
      auto news = camera_.try_grab();
      if (!news.ok()) {
        complain(describe(news.error()));
        break;
      }
      if (!news.value()) break;
      if (newest) output_.count(newest->stamp);
      newest = std::move(*news.value());
    }
    if (!newest) return;
    last_news_ = clock_.now();
    if (!failure_.empty()) tell("frames again");
    failure_.clear();
    output_.add(newest->image, newest->stamp, false, camera_.counters());
  }

  void complain(const std::string& what) {
    if (failure_.empty()) tell(what);
    failure_ = what;
  }

  void tell(const std::string& what) {
    output_.finish_line();
    progress_.warn("camera " + camera_.info().name + ": " + what);
  }

  Camera& camera_;
  Clock& clock_;
  PreviewOutput& output_;
  Progress& progress_;
  bool running_ = false;
  Stamp retry_at_{}, last_news_{};
  std::string failure_;
};

/// Frames of a lit hold, as the executive's loop hands them on.
class LitSink final : public ScanSink {
 public:
  LitSink(Camera& camera, PreviewDrawer& drawer, Progress& progress)
      : camera_(camera), drawer_(drawer), progress_(progress) {}
  void joints(const JointState&) override {}
  void frame(const FrameRecord& record, const cv::Mat& image) override {
    if (record.phase == Phase::kSweep)
      drawer_.add(image, record.stamp, record.laser_on, camera_.counters());
    else
      drawer_.add_background(image);
  }
  void event(Stamp, std::string_view kind, const std::string& text) override {
    if (kind != event_kind::kFault && kind != event_kind::kRealTime) return;
    drawer_.finish_line();
    progress_.warn((kind == event_kind::kFault ? "preview: " : "real time ") + text);
  }

 private:
  Camera& camera_;
  PreviewDrawer& drawer_;
  Progress& progress_;
};

/// The camera delivers, before the laser goes on for it.
/// Errors: InputError with the driver's last word if it does not.
void require_frames(Camera& camera, Clock& clock) {
  const Waiting told("a frame of camera " + camera.info().name);
  std::string why = "none came";
  const Stamp end = clock.now() + kFirstFrame;
  Status started = camera.start();
  while (clock.now() < end && !StopOnSignal::requested()) {
    if (!started.ok()) started = camera.start();
    if (!started.ok()) why = describe(started.error());
    const auto news = camera.try_grab();
    if (!news.ok()) why = describe(news.error());
    if (news.ok() && news.value()) {
      camera.stop();
      return;
    }
    clock.sleep_until(std::min(clock.now() + kLongestSleep, end));
  }
  camera.stop();
  if (!StopOnSignal::requested())
    throw InputError("camera " + camera.info().name + ": " + why + ", expected a frame within 5 s");
}

ScanResult lit_preview(const CameraPreviewOptions& options, const RigConfig& rig, Backend& backend,
                       const CameraChoice& camera, PreviewOutput& output, Progress& progress) {
  if (!backend.interlock_closed()) throw InputError(kInterlockOpen);
  const StartWarning warning(rig, backend, "its laser will shine, with its arm at rest", true, progress);
  const RigStops stops(backend, progress);
  make_laser_dark(backend, rig.scan);
  require_frames(*camera.device, backend.clock());
  ScanSettings settings = rig.scan;
  settings.capture.laser_pairs = false;
  settings.capture.dark_frames = kDarkFrames;
  settings.capture.frame_period = 1 / camera.rig->rate_hz;
  settings.capture.laser_warm_up = std::max(settings.capture.laser_warm_up, seconds(backend.laser().warm_up()));
  const JointVector posture = homed_posture(backend, options.rig);
  const ScanPlan plan = make_lit_hold_plan(settings, posture, options.seconds.value_or(kLitSeconds));
  check_light(plan, settings.safety);
  PreviewDrawer drawer(output, backend.clock().real_time());
  LitSink sink(*camera.device, drawer, progress);
  ScanJob job{plan,
              settings,
              backend.clock(),
              backend.arm(),
              backend.laser(),
              {{camera.device, RecordWhen::kAll, stripe_in_view(rig, *camera.rig)}},
              sink,
              StopOnSignal::requested(),
              [&] { return backend.interlock_closed(); },
              {},
              [&](const std::string& what) {
                drawer.finish_line();
                progress.cut(what);
              }};
  try {
    Motion(backend, settings.safety, progress).run(job);
    drawer.end();
    return job.result;
  } catch (const InputError& e) {
    if (job.result.status.empty()) throw;  // nothing was touched
    throw InputError(std::string(e.what()) + "; " + to_string(job.result.left));
  }
}

void print(const CameraPreviewOptions& options, const CameraInfo& info, const PreviewOutput& output) {
  const PreviewSummary& s = output.summary();
  if (options.json) {
    print_json({{"camera", info.name},
                {"width_px", info.width},
                {"height_px", info.height},
                {"frames", s.frames},
                {"refreshes", s.refreshes},
                {"frames_per_s", s.frames_per_s},
                {"lost", s.lost},
                {"focus", s.focus},
                {"best_focus", s.best_focus},
                {"clipped_share", s.clipped_share},
                {"stripe_points", options.laser ? nlohmann::ordered_json(s.stripe_points) : nlohmann::ordered_json()},
                {"picture", output.picture().string()},
                {"page", output.page().string()}});
    return;
  }
  fmt::print("{}: {} frames, {} lost, {} refreshes; best focus {:.1f}; last picture in {}, live in {}\n", info.name,
             s.frames, s.lost, s.refreshes, s.best_focus, output.picture().string(), output.page().string());
}

int camera_preview(const CameraPreviewOptions& options) {
  if (options.laser && options.seconds.value_or(0) > kLongestLitPreview)
    throw InputError(
        fmt::format("--seconds: found {:g}, expected at most {:g} with --laser", *options.seconds, kLongestLitPreview));
  if (std::isnan(options.rate_hz) || std::isnan(options.seconds.value_or(0)))
    throw InputError("--rate, --seconds: found no number, expected one");
  page_of(options.out);
  Progress progress;
  const RigConfig rig = load_rig(find_rig(options.rig));
  if (options.laser) require_commission(rig, options.waived);
  if (options.laser) confirm("The laser of " + rig.name + " will shine. Is everybody's sight protected?", options.yes);
  const StopOnSignal stop_on_signal;  // before the devices: it outlives them
  const RigCamera& chosen = choose_camera(rig, options.camera);
  const OwnBackend backend =
      make_backend(rig, {.need = {.arm = options.laser, .laser = options.laser, .only_camera = chosen.name},
                         .command = "camera preview"});
  const CameraChoice camera{backend->cameras().front(), &chosen};
  if (!backend->laser_unknown().empty()) progress.warn(backend->laser_unknown());
  PreviewOutput output(options.out, camera.rig->name, options.rate_hz);

  std::string failure;
  if (options.laser) {
    const ScanResult result = lit_preview(options, rig, *backend, camera, output, progress);
    const bool asked = StopOnSignal::requested() && result.left.safe();
    if (!result.complete() && !asked) failure = "preview " + result.status + "; " + to_string(result.left);
    output.finish_line();
    if (failure.empty()) progress.note(to_string(result.left));
  } else {
    const bool virtual_time = dynamic_cast<VirtualClock*>(&backend->clock()) != nullptr;
    const double unlimited = virtual_time ? kVirtualSeconds : std::numeric_limits<double>::infinity();
    FreePreview preview(*camera.device, backend->clock(), output, progress);
    preview.run(options.seconds.value_or(unlimited));
    failure = preview.failure();
  }
  output.finish_line();
  if (failure.empty() && output.summary().refreshes == 0 && !StopOnSignal::requested())
    failure = "camera " + camera.rig->name + ": found no frame, expected some";
  print(options, camera.device->info(), output);
  if (failure.empty()) return kOk;
  progress.warn(failure);
  return kFailure;
}

}  // namespace

void add_camera(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* camera = app.add_subcommand("camera", "Look through a camera");
  camera->require_subcommand(1);
  camera->footer("Example: tankrig camera preview --rig tank-sim --camera mono");
  CLI::App* c = camera->add_subcommand(
      "preview", "Refresh a picture with focus, clipped pixels, histogram and, with the laser on, the stripe");
  CameraPreviewOptions& o = options_of(c, chosen, &camera_preview);
  c->footer(
      "Example: tankrig camera preview --rig tank-sim --out preview.png    (then open preview.html in a browser)");
  add_rig_option(c, o.rig);
  c->add_option("--camera", o.camera, "Name of the camera (default: the rig file's first)");
  c->add_option("--out", o.out, "Picture to refresh, .png; an .html page beside it shows it live")
      ->capture_default_str();
  c->add_option("--seconds", o.seconds,
                "Duration [s] (default: until Ctrl-C; 2 s on a simulated rig; with --laser 30 s, and 120 s at most)")
      ->check(CLI::PositiveNumber);
  c->add_option("--rate", o.rate_hz, "Highest refresh rate [Hz]")->check(CLI::Range(0.1, 30.0))->capture_default_str();
  c->add_flag("--laser", o.laser, "Ask, switch the laser on with the arm at rest, and mark the stripe");
  add_waive_option(c, o.waived);
  c->add_flag("--yes", o.yes, "Do not ask before the laser is switched on");
  c->add_flag("--json", o.json, "Print one JSON object on standard output at the end");
}

}  // namespace tankrig::app
