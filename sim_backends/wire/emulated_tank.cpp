#include "sim_backends/wire/emulated_tank.hpp"

#include <fmt/format.h>

#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>

#include "core/input_error.hpp"
#include "core/thread_priority.hpp"
#include "drivers/can/open_can.hpp"
#include "sim_backends/faults/picture_faults.hpp"
#include "sim_backends/wire/wire_faults.hpp"

namespace tankrig::sim {
namespace {

/// What was true of a camera's exposures.
class ExposureTruth {
 public:
  explicit ExposureTruth(const std::filesystem::path& file) : out_(file) {
    if (!out_) throw InputError(file, "cannot be written");
    out_ << "index,mid_ns,elbow_rad,laser\n";
  }
  void add(const Exposure& e) {
    constexpr std::size_t kMiddle = Exposure::kSamples / 2;
    out_ << fmt::format("{},{},{:.9f},{:.3f}\n", e.index, e.mid.ns, e.q[kMiddle][kElbow], e.laser[kMiddle])
         << std::flush;
  }

 private:
  std::ofstream out_;
};

}  // namespace

struct EmulatedTank::Impl {
  Impl(const TankWorld& tank, EmulatedTankSettings s, Clock& real_clock)
      : world(tank),
        settings(std::move(s)),
        clock(real_clock),
        laser(settings.laser_warm_up, clock),
        script(settings.faults) {
    if (settings.arm) start_arm(*settings.arm);
    if (settings.laser) {
      relay.emplace(*settings.laser, laser);
      tell("laser", settings.laser->name.string());
    }
    if (settings.lux) {
      lux.emplace(*settings.lux, [this] { return spoilt_lux(script, world.lux(), clock.now(), last_lux); });
      tell("lux meter", settings.lux->name.string());
    }
    if (settings.box) {
      feed(false);
      box.emplace(*settings.box, [this](bool closed) { feed(closed); });
      tell("watchdog box", settings.box->name.string());
    }
    if (!settings.hand.empty()) hand.emplace(settings.hand, [this](HandDeed deed) { do_by_hand(deed); });
    if (!settings.truth.empty()) std::filesystem::create_directories(settings.truth);
    for (const GigeCameraSettings& camera : settings.cameras) {
      cameras.push_back(std::make_unique<GigeCameraEmulator>(camera, pictures_of(camera.user_id)));
      tell("camera " + camera.user_id, camera.address);
    }
    for (const EmulatedVideoOutput& camera : settings.video_outputs) {
      video_outputs.push_back(std::make_unique<V4l2OutputEmulator>(camera.output, pictures_of(camera.name)));
      tell("camera " + camera.name, camera.output.device);
    }
    if (world.next_place(clock.now()))
      foreseeing = std::jthread([this](std::stop_token stop) { foresee_places(stop); });
    if (!settings.faults.faults.empty()) play_faults();
  }

  void play_faults() {
    settings.faults.check(FaultLevel::kWire);
    WireDevices devices{
        arm ? &*arm : nullptr, hub ? &*hub : nullptr, &laser, relay ? &*relay : nullptr, lux ? &*lux : nullptr, {}, {}};
    for (std::size_t i = 0; i < cameras.size(); ++i) devices.cameras[settings.cameras[i].user_id] = cameras[i].get();
    for (std::size_t i = 0; i < video_outputs.size(); ++i)
      devices.outputs[settings.video_outputs[i].name] = video_outputs[i].get();
    script.mark(FaultOrigin::kStart, clock.now());
    faults.emplace(script, std::move(devices));
  }

  /// By the box's contactors.
  void feed(bool closed) {
    if (arm) arm->set_fed(closed);
    if (relay) relay->set_fed(closed);
  }

  void do_by_hand(HandDeed deed) {
    if (relay && (deed == HandDeed::kOpenLid || deed == HandDeed::kCloseLid))
      relay->set_interlock_closed(deed == HandDeed::kCloseLid);
    if (box && (deed == HandDeed::kPressStop || deed == HandDeed::kReleaseStop))
      box->press_stop(deed == HandDeed::kPressStop);
  }

  void tell(const std::string& device, const std::string& where) {
    description += fmt::format("{:<12} {}\n", device, where);
  }

  void start_arm(const EmulatedArm& s) {
    arm.emplace(world.arm(), s.parameters, clock);
    if (s.hub) {
      hub.emplace(*s.hub);
      serve_arm("unix:" + s.hub->path.string(), s.parameters);
    }
    if (!s.can_interface.empty()) serve_arm(s.can_interface, s.parameters);
    if (!s.line.empty()) {
      arm->serve(s.line);
      tell("arm", s.line.string());
    }
    if (!s.zero_file.empty()) save_arm_zero(s.zero_file, zero_as_homed(*arm, s.parameters));
  }

  void serve_arm(const std::string& interface, const ArmEmulatorParameters& parameters) {
    CanSettings can;
    can.interface = interface;
    can.bitrate = parameters.can_bitrate;
    can.filters = parameters.can_ids.host_filters();
    arm->serve(open_can(can, clock));
    tell("arm", interface);
  }

  Exposure expose(Stamp mid, Duration exposure, std::uint64_t index) {
    return sample_exposure(
        mid, exposure, index, [this](Stamp t) { return joints_at(t); }, [this](Stamp t) { return laser.power_at(t); });
  }

  /// Makes each next place of a board ready while the one before is shown.
  void foresee_places(std::stop_token stop) {
    set_background("board-ahead");
    std::mutex mutex;
    std::condition_variable_any wake;
    std::unique_lock lock(mutex);
    while (!stop.stop_requested()) {
      const Stamp next = *world.next_place(clock.now());
      for (const std::string& camera : filming) world.foresee_boards(camera, expose(next, {}, 0));
      wake.wait_until(lock, stop, std::chrono::steady_clock::time_point{Duration{next.ns}}, [] { return false; });
    }
  }

  /// What a camera sees from now on. Its first picture takes a second, and is made here.
  PictureSource pictures_of(const std::string& camera) {
    world.render(camera, expose(clock.now(), {}, 0));
    filming.push_back(camera);
    ExposureTruth* truth = nullptr;
    if (!settings.truth.empty())
      truth = truths.emplace_back(std::make_unique<ExposureTruth>(settings.truth / (camera + ".csv"))).get();
    PictureFaults& spoiler = *spoilers.emplace_back(std::make_unique<PictureFaults>(camera, script));
    return [this, truth, camera, &spoiler](std::uint64_t index, Stamp begin, Duration exposure) {
      const Exposure e = expose(begin + exposure / 2 - world.latency(), exposure, index);
      if (truth) truth->add(e);
      if (const FaultSpec* late = script.active(FaultDevice::kCamera, FaultKind::kDelayed, clock.now(), camera))
        clock.sleep_until(clock.now() + late->delay);
      return spoiler.spoilt(world.render(camera, e), index, clock.now());
    };
  }

  JointVector joints_at(Stamp when) { return arm ? arm->truth_at(when) : resting; }

  const TankWorld& world;
  const EmulatedTankSettings settings;
  Clock& clock;
  std::string description;
  const JointVector resting = ArmEmulatorParameters{}.power_up;
  MockLaser laser;
  FaultScript script;
  double last_lux = world.lux();
  std::optional<CanHub> hub;
  std::optional<ArmEmulator> arm;
  std::optional<RelayEmulator> relay;
  std::optional<LuxEmulator> lux;
  std::optional<BoxEmulator> box;
  std::optional<EmulatedHand> hand;
  std::vector<std::string> filming;  ///< cameras, from the start on
  std::vector<std::unique_ptr<ExposureTruth>> truths;
  std::vector<std::unique_ptr<PictureFaults>> spoilers;
  std::vector<std::unique_ptr<GigeCameraEmulator>> cameras;  // last: their threads ask the devices above
  std::vector<std::unique_ptr<V4l2OutputEmulator>> video_outputs;
  std::optional<WireFaults> faults;
  std::jthread foreseeing;
};

EmulatedTank::EmulatedTank(const TankWorld& world, EmulatedTankSettings settings, Clock& clock)
    : impl_(std::make_unique<Impl>(world, std::move(settings), clock)) {}

EmulatedTank::~EmulatedTank() = default;

const std::string& EmulatedTank::description() const { return impl_->description; }

}  // namespace tankrig::sim
