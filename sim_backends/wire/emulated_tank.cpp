#include "sim_backends/wire/emulated_tank.hpp"

#include <cstdio>
#include <fstream>

#include "core/input_error.hpp"
#include "core/utc.hpp"
#include "drivers/arm/arm_zero.hpp"
#include "drivers/can/open_can.hpp"

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
    char line[96];
    std::snprintf(line, sizeof line, "%llu,%lld,%.9f,%.3f\n", static_cast<unsigned long long>(e.index),
                  static_cast<long long>(e.mid.ns), e.q[kMiddle][kElbow], e.laser[kMiddle]);
    out_ << line << std::flush;
  }

 private:
  std::ofstream out_;
};

}  // namespace

struct EmulatedTank::Impl {
  Impl(const TankWorld& tank, EmulatedTankSettings s, Clock& real_clock)
      : world(tank), settings(std::move(s)), clock(real_clock), laser(settings.laser_warm_up, clock) {
    if (settings.arm) start_arm(*settings.arm);
    if (settings.laser) {
      relay.emplace(*settings.laser, laser);
      tell("laser", settings.laser->name.string());
    }
    if (settings.lux) {
      lux.emplace(*settings.lux, [this] { return world.lux(); });
      tell("lux meter", settings.lux->name.string());
    }
    if (!settings.truth.empty()) std::filesystem::create_directories(settings.truth);
    for (const EmulatedCamera& camera : settings.cameras) {
      world.render(camera.name, sample_exposure(
                                    clock.now(), Duration{}, 0, [&](Stamp t) { return joints_at(t); },
                                    [](Stamp) { return 0.0; }));  // a camera's first picture takes a second
      start_camera(camera);
    }
  }

  void tell(const std::string& device, const std::string& where) {
    char line[300];
    std::snprintf(line, sizeof line, "%-12s %s\n", device.c_str(), where.c_str());
    description += line;
  }

  void start_arm(const EmulatedArm& s) {
    arm.emplace(world.arm(), s.parameters, clock);
    std::string interface = s.can_interface;
    if (s.hub) {
      hub.emplace(*s.hub);
      interface = "unix:" + s.hub->path.string();
    }
    if (!interface.empty()) {
      CanSettings can;
      can.interface = interface;
      can.bitrate = s.parameters.can_bitrate;
      can.filters = s.parameters.can_ids.host_filters();
      arm->serve(open_can(can, clock));
      tell("arm", interface);
    }
    if (!s.line.empty()) {
      arm->serve(s.line);
      tell("arm", s.line.string());
    }
    if (!s.zero_file.empty()) save_arm_zero(s.zero_file, {arm->true_zero(), utc_now()});
  }

  void start_camera(const EmulatedCamera& s) {
    ExposureTruth* truth = nullptr;
    if (!settings.truth.empty())
      truth = truths.emplace_back(std::make_unique<ExposureTruth>(settings.truth / (s.name + ".csv"))).get();
    const auto picture = [this, truth, name = s.name](std::uint64_t index, Stamp begin, Duration exposure) {
      const Exposure e = sample_exposure(
          begin + exposure / 2, exposure, index, [&](Stamp t) { return joints_at(t); },
          [&](Stamp t) { return laser.power_at(t); });
      if (truth) truth->add(e);
      return world.render(name, e);
    };
    cameras.push_back(std::make_unique<GigeCameraEmulator>(s.gige, picture));
    tell("camera " + s.name, s.gige.address);
  }

  JointVector joints_at(Stamp when) { return arm ? arm->truth_at(when) : resting; }

  const TankWorld& world;
  const EmulatedTankSettings settings;
  Clock& clock;
  std::string description;
  const JointVector resting = ArmEmulatorParameters{}.power_up;
  MockLaser laser;
  std::optional<CanHub> hub;
  std::optional<ArmEmulator> arm;
  std::optional<RelayEmulator> relay;
  std::optional<LuxEmulator> lux;
  std::vector<std::unique_ptr<ExposureTruth>> truths;
  std::vector<std::unique_ptr<GigeCameraEmulator>> cameras;  // last: their threads ask the devices above
};

EmulatedTank::EmulatedTank(const TankWorld& world, EmulatedTankSettings settings, Clock& clock)
    : impl_(std::make_unique<Impl>(world, std::move(settings), clock)) {}

EmulatedTank::~EmulatedTank() = default;

const std::string& EmulatedTank::description() const { return impl_->description; }

}  // namespace tankrig::sim
