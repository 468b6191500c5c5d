// Puts one frame together: static light, the laser's glow and stripe, particles, arm, sensor.
//
// Simplifications: light is scattered at most once; arm and moving boards throw no shadow in the lamps' light (the arm
// does in the laser's); the laser does not light them.
#include "sim_backends/world/tank_world.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <deque>
#include <mutex>

#include "core/input_error.hpp"
#include "sim_backends/world/arm_layer.hpp"
#include "sim_backends/world/board_layer.hpp"
#include "sim_backends/world/external_view.hpp"
#include "sim_backends/world/hash_noise.hpp"
#include "sim_backends/world/laser_layer.hpp"
#include "sim_backends/world/particles.hpp"
#include "sim_backends/world/scene.hpp"
#include "sim_backends/world/sensor_noise.hpp"

namespace tankrig::sim {
namespace {

static_assert(Exposure::kSamples == ExposedSheet::kSamples);

double in_range(const char* name, double value, double upper) {
  if (value >= 0 && value <= upper) return value;
  throw InputError(fmt::format("{}: found {:g}, expected 0 .. {:g}", name, value, upper));
}

std::vector<BoardSpec> chosen_boards(const Scene& scene, const std::vector<std::string>& names) {
  std::vector<BoardSpec> chosen;
  for (const std::string& name : names) {
    const auto named = [&](const BoardSpec& board) { return board.name == name; };
    const auto board = std::find_if(scene.boards.begin(), scene.boards.end(), named);
    if (board == scene.boards.end()) {
      std::string known;
      for (const BoardSpec& b : scene.boards) known += (known.empty() ? "" : ", ") + b.name;
      throw InputError(scene.file, "found no board called " + name + ", expected " +
                                       (known.empty() ? "none: the scene has no boards" : "one of: " + known));
    }
    if (std::none_of(chosen.begin(), chosen.end(), named)) chosen.push_back(*board);
  }
  return chosen;
}

Scene apply(Scene scene, const WorldOptions& options) {
  scene.boards = chosen_boards(scene, options.boards);
  if (options.truth) scene = as_built(std::move(scene), *options.truth);
  if (options.light) scene.light = in_range("light", *options.light, 1);
  if (options.particles_per_m3)
    scene.water.particles_per_m3 = in_range("particles_per_m3", *options.particles_per_m3, 1e6);
  if (options.particle_drift) scene.water.particle_drift = *options.particle_drift;
  if (options.turbidity) {
    const auto more = static_cast<float>(in_range("turbidity", *options.turbidity, 10));
    scene.water.attenuation += more;
    scene.water.backscatter += more;
  }
  for (CameraSpec& camera : scene.cameras) {
    if (options.noise) camera.sensor.gaussian_sd = in_range("noise", *options.noise, 1);
    if (!options.sensor) continue;
    if (*options.sensor != "gaussian" && *options.sensor != "emva1288")
      throw InputError("sensor: found " + *options.sensor + ", expected gaussian or emva1288");
    camera.sensor.model = *options.sensor == "gaussian" ? Sensor::Model::kGaussian : Sensor::Model::kEmva1288;
  }
  return scene;
}

constexpr std::size_t kBoardsRemembered = 3;

/// A camera and what is computed for it at its first frame.
struct CameraStation {
  CameraSpec spec;
  SensorNoise noise;
  std::uint64_t speckle_key;
  mutable std::once_flag once{};
  mutable std::unique_ptr<const CameraView> view{};
  mutable std::mutex mutex{};  // guards what follows
  /// Newest first: the next place, the present one, and the one before for a frame that is late.
  mutable std::deque<std::pair<std::vector<PlacedBoard>, std::shared_ptr<const BoardLayer>>> boards_seen{};

  CameraStation(const CameraSpec& camera, std::uint64_t seed)
      : spec(camera), noise(camera, seed), speckle_key(mix(mix(seed, hash_text("speckle")), hash_text(camera.name))) {}
};

}  // namespace

/// A board that moves.
struct MovingBoard {
  BoardSpec spec;
  std::shared_ptr<const BoardPrint> print;
  std::vector<Transform> places;  ///< of one that is shown
};

struct FrameLayers {
  const CameraStation* station;
  std::uint64_t index;
  ParticleLayer floating;
  ArmLayer arm;
  std::shared_ptr<const BoardLayer> boards;
  LaserLayer laser;
};

struct TankWorld::Impl {
  Scene scene;
  RenderGeometry geometry;
  Radiometry radiometry;
  LaserSheet sheet;
  ParticleField particles;
  std::vector<std::unique_ptr<CameraStation>> stations;
  std::vector<MovingBoard> moving_boards;
  Duration latency;

  Impl(Scene s, const WorldOptions& options)
      : scene(apply(std::move(s), options)),
        geometry(scene),
        radiometry(scene, geometry),
        sheet(scene.laser, radiometry.laser_attenuation()),
        particles(scene, options.seed),
        latency(options.truth ? options.truth->latency : Duration{}) {
    for (const CameraSpec& c : scene.cameras) stations.push_back(std::make_unique<CameraStation>(c, options.seed));
    for (const BoardSpec& board : scene.boards) {
      if (board.place == BoardSpec::Place::kTank) continue;
      MovingBoard moving{board, std::make_shared<const BoardPrint>(board.pattern), {}};
      for (const BoardShow& show : board.shows)
        for (const Transform& place : places_of(show, *moving.print, station(show.camera).spec, geometry))
          moving.places.push_back(place);
      moving_boards.push_back(std::move(moving));
    }
  }

  Transform wMt(const BoardSpec& board, const std::vector<Transform>& places, Stamp when, const JointVector& q) const {
    switch (board.place) {
      case BoardSpec::Place::kTank:
        return board.pose;
      case BoardSpec::Place::kEndEffector:
        return scene.arm.wMb * scene.arm.model.bMe(q) * board.pose;
      case BoardSpec::Place::kShown:
        break;
    }
    return places[static_cast<std::size_t>(when.ns / board.hold.count()) % places.size()];
  }

  std::vector<PlacedBoard> boards_at(const Exposure& exposure) const {
    std::vector<PlacedBoard> placed;
    for (const MovingBoard& board : moving_boards)
      placed.push_back({board.print, wMt(board.spec, board.places, exposure.mid, exposure.q[Exposure::kSamples / 2])});
    return placed;
  }

  const CameraStation& station(const std::string& name) const {
    for (const auto& s : stations)
      if (s->spec.name == name) return *s;
    std::string known;
    for (const auto& s : stations) known += (known.empty() ? "" : ", ") + s->spec.name;
    throw InputError(scene.file, "found no camera called " + name + ", expected one of: " + known);
  }

  const CameraView& view(const CameraStation& s) const {
    // Isolated, so that a thread that waits inside takes no other frame's work and comes back here.
    std::call_once(s.once, [&] {
      tbb::this_task_arena::isolate([&] { s.view = std::make_unique<CameraView>(s.spec, geometry, radiometry); });
    });
    return *s.view;
  }

  /// Boards that have not moved look the same.
  std::shared_ptr<const BoardLayer> boards_seen(const CameraStation& s, std::vector<PlacedBoard> placed) const {
    const auto same = [](const PlacedBoard& a, const PlacedBoard& b) {
      return a.print == b.print && a.wMt.matrix() == b.wMt.matrix();
    };
    {
      const std::lock_guard lock(s.mutex);
      for (const auto& [where, boards] : s.boards_seen)
        if (std::equal(placed.begin(), placed.end(), where.begin(), where.end(), same)) return boards;
    }
    auto boards = std::make_shared<const BoardLayer>(placed, view(s), radiometry);
    const std::lock_guard lock(s.mutex);
    s.boards_seen.emplace_front(std::move(placed), boards);
    if (s.boards_seen.size() > kBoardsRemembered) s.boards_seen.pop_back();
    return boards;
  }

  ExposedSheet exposed_sheet(const Exposure& exposure, const std::vector<Capsule>& bodies) const {
    ExposedSheet sheet_now;
    for (int k = 0; k < Exposure::kSamples; ++k) {
      sheet_now.pose[k] = SheetPose(scene.arm.wMb * scene.arm.model.bMe(exposure.q[k]) * scene.laser.eMl);
      sheet_now.power[k] = static_cast<float>(exposure.laser[k]) / Exposure::kSamples;
    }
    sheet_now.blockers = bodies_in_sheet(bodies, sheet_now.pose[Exposure::kSamples / 2]);
    return sheet_now;
  }

  FrameLayers layers(const CameraStation& s, const Exposure& exposure) const {
    const CameraView& v = view(s);
    const auto bodies = arm_bodies(scene.arm, scene.laser, exposure.q[Exposure::kSamples / 2]);
    const ExposedSheet sheet_now = exposed_sheet(exposure, bodies);
    return {&s,
            exposure.index,
            ParticleLayer(particles, exposure.mid, v, radiometry, sheet, sheet_now, scene.laser.colour, geometry),
            ArmLayer(bodies, v),
            boards_seen(s, boards_at(exposure)),
            LaserLayer(v, sheet, sheet_now, geometry, scene.water.laser_scattering)};
  }

  cv::Mat expose(const FrameLayers& frame, float light, double noise) const {
    const CameraStation& s = *frame.station;
    const CameraView& v = view(s);
    const int width = v.width(), height = v.height(), channels = v.channels();
    const auto discs = frame.floating.lit(light);
    const auto colour = v.response(scene.laser.colour);
    const auto contrast = static_cast<float>(scene.laser.speckle_contrast);
    const std::uint64_t speckle_key = mix(s.speckle_key, frame.index);

    cv::Mat image(height, width, channels == 1 ? CV_8UC1 : CV_8UC3);
    constexpr int kRows = LaserLayer::kTile;
    tbb::parallel_for(0, (height + kRows - 1) / kRows, [&](int strip) {
      thread_local std::vector<float> rows;
      const int first = strip * kRows, count = std::min(kRows, height - first);
      const std::size_t row_size = static_cast<std::size_t>(width) * channels;
      rows.resize(row_size * kRows);
      const float* unlit = v.radiance_row(first);
      for (std::size_t i = 0; i < row_size * count; ++i) rows[i] = light * unlit[i];
      frame.laser.add_glow(strip, rows.data(), colour);
      frame.laser.add_stripe(strip, rows.data(), colour, contrast, speckle_key);
      frame.floating.blend(discs, first, count, rows.data());
      frame.boards->cover(first, count, rows.data(), light);
      if (frame.arm.in_view()) frame.arm.cover(first, count, rows.data(), radiometry, light, *frame.boards);
      for (int r = 0; r < count; ++r)
        s.noise.digitise(frame.index, first + r, noise, rows.data() + r * row_size, image.ptr(first + r));
    });
    return image;
  }
};

TankWorld::TankWorld(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TankWorld::~TankWorld() = default;
TankWorld::TankWorld(TankWorld&&) noexcept = default;
TankWorld& TankWorld::operator=(TankWorld&&) noexcept = default;

TankWorld TankWorld::load(const std::filesystem::path& scene, const WorldOptions& options) {
  return from_scene(read_scene(scene), options);
}

TankWorld TankWorld::from_scene(Scene scene, const WorldOptions& options) {
  return TankWorld(std::make_unique<Impl>(std::move(scene), options));
}

const std::vector<std::string>& TankWorld::warnings() const { return impl_->scene.warnings; }
const std::vector<CameraSpec>& TankWorld::cameras() const { return impl_->scene.cameras; }
const ArmModel& TankWorld::arm() const { return impl_->scene.arm.model; }
const std::vector<BoardSpec>& TankWorld::boards() const { return impl_->scene.boards; }

Transform TankWorld::wMt(const std::string& name, Stamp when, const JointVector& q) const {
  for (const MovingBoard& board : impl_->moving_boards)
    if (board.spec.name == name) return impl_->wMt(board.spec, board.places, when, q);
  for (const BoardSpec& board : impl_->scene.boards)
    if (board.name == name) return impl_->wMt(board, {}, when, q);
  throw InputError(impl_->scene.file, "found no board called " + name + " in this world");
}

Transform TankWorld::wMb() const { return impl_->scene.arm.wMb; }
Transform TankWorld::eMl() const { return impl_->scene.laser.eMl; }
Duration TankWorld::latency() const { return impl_->latency; }
double TankWorld::light() const { return impl_->scene.light; }

namespace {
const SceneObject& target(const Scene& scene) {
  for (const SceneObject& object : scene.objects)
    if (object.target) return object;
  throw InputError(scene.file, "found no object marked as target, expected one");
}
}  // namespace

Transform TankWorld::wMo() const { return target(impl_->scene).wMo; }
std::filesystem::path TankWorld::object_mesh() const { return target(impl_->scene).mesh; }

std::string TankWorld::noise_description() const {
  std::vector<std::string> each;
  for (const CameraSpec& camera : impl_->scene.cameras) each.push_back(describe(camera.sensor));
  if (std::equal(each.begin() + (each.empty() ? 0 : 1), each.end(), each.begin())) return each.empty() ? "" : each[0];
  std::string text;
  for (std::size_t i = 0; i < each.size(); ++i) text += (i ? "; " : "") + impl_->scene.cameras[i].name + ": " + each[i];
  return text;
}

cv::Mat TankWorld::render(const std::string& name, const Exposure& exposure) const {
  return expose(impl_->layers(impl_->station(name), exposure), impl_->scene.light);
}

std::shared_ptr<const FrameLayers> TankWorld::layers(const std::string& name, const Exposure& exposure) const {
  return std::make_shared<const FrameLayers>(impl_->layers(impl_->station(name), exposure));
}

cv::Mat TankWorld::expose(const FrameLayers& frame, double light, std::optional<double> noise) const {
  return impl_->expose(frame, static_cast<float>(in_range("light", light, 1)),
                       noise ? in_range("noise", *noise, 1) : frame.station->spec.sensor.gaussian_sd);
}

std::optional<Stamp> TankWorld::next_place(Stamp when) const {
  std::optional<Stamp> next;
  for (const MovingBoard& board : impl_->moving_boards) {
    if (board.spec.place != BoardSpec::Place::kShown) continue;
    const std::int64_t hold = board.spec.hold.count();
    const Stamp then{(when.ns / hold + 1) * hold};
    next = next ? std::min(*next, then) : then;
  }
  return next;
}

void TankWorld::foresee_boards(const std::string& name, const Exposure& exposure) const {
  const CameraStation& s = impl_->station(name);
  std::vector<PlacedBoard> placed = impl_->boards_at(exposure);
  tbb::task_arena(1).execute([&] { impl_->boards_seen(s, std::move(placed)); });
}

cv::Mat TankWorld::render_external(const JointVector& q, bool laser_on, int width, int height) const {
  return external_view(impl_->scene, impl_->geometry, q, laser_on, width, height);
}

double TankWorld::lux() const {
  const LuxMeterSpec& meter = impl_->scene.lux_meter;
  const Vector3f p = meter.position.cast<float>(), n = meter.normal.normalized().cast<float>();
  return impl_->scene.light * photopic(impl_->radiometry.direct(p, n) + impl_->radiometry.ambient(p, n, 32));
}

}  // namespace tankrig::sim
