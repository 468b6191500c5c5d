// From a scene file to a Scene: which element means what.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "core/regular_file.hpp"
#include "core/xml_element.hpp"
#include "sim_backends/world/scene.hpp"

namespace tankrig::sim {
namespace {

Material read_material(const XmlElement& element, Material material) {
  element.expect({"albedo", "texture", "contrast", "scale"});
  material.albedo = element.rgb_or("albedo", material.albedo, kFraction);
  if (const auto texture = element.optional("texture")) {
    const std::string name = texture->text();
    if (name == "plain")
      material.texture = Material::Texture::kPlain;
    else if (name == "speckle")
      material.texture = Material::Texture::kSpeckle;
    else if (name == "labels")
      material.texture = Material::Texture::kLabels;
    else
      texture->fail("<texture>: found '" + name + "', expected plain, speckle or labels");
  }
  material.contrast = static_cast<float>(element.number_or("contrast", material.contrast, kFraction));
  material.scale = element.number_or("scale", material.scale, {1e-4, 10});
  return material;
}

void read_ocean(const XmlElement& element, Water& water) {
  element.expect({"attenuation"}, {},
                 {"windx", "windy", "windSpeed", "depth", "reflectionDamping", "waveScale", "isNotChoppy",
                  "choppyFactor", "crestFoamHeight", "oceanSurfaceHeight", "fog", "color"});
  water.attenuation = element.rgb_or("attenuation", water.attenuation, {0, 10});
}

void read_water(const XmlElement& element, Scene& scene) {
  element.expect({"depth", "backscatter", "veil", "laserScattering", "particles"});
  Water& water = scene.water;
  scene.tank.water_depth = element.number_or("depth", scene.tank.water_depth, {0.1, 100});
  water.backscatter = element.rgb_or("backscatter", water.backscatter, {0, 10});
  water.veil = element.rgb_or("veil", water.veil, kNotNegative);
  water.laser_scattering = static_cast<float>(element.number_or("laserScattering", water.laser_scattering, {0, 10}));
  if (const auto particles = element.optional("particles")) {
    particles->expect({"density", "radius", "drift"});
    water.particles_per_m3 = particles->number("density", {0, 1e5});
    water.particle_radius = particles->number_or("radius", water.particle_radius, {1e-6, 0.01});
    water.particle_drift = particles->xyz_or("drift", water.particle_drift, {-10, 10});
  }
}

void read_simulation(const XmlElement& element, Scene& scene) {
  element.expect({"lightRate", "ambientIlluminance"}, {},
                 {"disableShaders", "eye_in_hand", "resw", "resh", "offsetp", "offsetr", "gravity", "enablePhysics",
                  "physics", "showTrajectory", "lockVehicleCamera", "frustrum"});
  scene.light = element.number_or("lightRate", scene.light, kFraction);
  scene.ambient_lux = element.number_or("ambientIlluminance", scene.ambient_lux, {0, 200000});
}

void read_tank(const XmlElement& element, TankWalls& tank) {
  element.expect({"size", "floor", "walls"});
  tank.size = element.xyz_or("size", tank.size, {0.1, 100});
  if (const auto floor = element.optional("floor")) tank.floor = read_material(*floor, tank.floor);
  if (const auto walls = element.optional("walls")) tank.walls = read_material(*walls, tank.walls);
}

Vector3d read_direction(const XmlElement& element, const char* name) {
  const Vector3d direction = element.xyz(name);
  if (direction.norm() < 1e-6)
    element.child(name).fail(std::string("<") + name + ">: found 0 0 0, expected a direction");
  return direction.normalized();
}

Lamp read_lamp(const XmlElement& element) {
  element.expect({"name", "position", "direction", "intensity", "halfAngle", "color"});
  Lamp lamp;
  lamp.name = element.text("name");
  lamp.position = element.xyz("position");
  lamp.direction = read_direction(element, "direction");
  lamp.candela = element.number("intensity", kNotNegative);
  lamp.half_angle = element.number_or("halfAngle", lamp.half_angle, {0.01, 1.55});
  lamp.colour = element.rgb_or("color", lamp.colour, {0, 10});
  return lamp;
}

SceneObject read_object(const XmlElement& element) {
  element.expect({"name", "file", "position", "orientation", "quaternion", "scaleFactor", "material", "target"}, {},
                 {"physics"});
  SceneObject object;
  object.name = element.text("name");
  const XmlElement file = element.child("file");
  object.mesh = std::filesystem::absolute(element.file().parent_path() / file.text()).lexically_normal();
  if (!std::filesystem::is_regular_file(object.mesh))
    file.fail("<file>: found no file " + object.mesh.string() + ", expected a triangle mesh");
  if (element.xyz_or("scaleFactor", Vector3d::Ones()) != Vector3d::Ones())
    element.child("scaleFactor").fail("<scaleFactor>: found another scale than 1 1 1, expected a mesh file in metres");
  object.wMo = element.pose();
  if (const auto material = element.optional("material")) object.material = read_material(*material, object.material);
  object.target = element.flag_or("target", false);
  return object;
}

Sensor read_sensor(const XmlElement& element, Sensor sensor) {
  element.expect({"model", "electronsPerLuxSecond", "fullWell", "readNoise", "prnu", "darkElectrons"});
  if (const auto model = element.optional("model")) {
    const std::string name = model->text();
    if (name != "gaussian" && name != "emva1288")
      model->fail("<model>: found '" + name + "', expected gaussian or emva1288");
    sensor.model = name == "gaussian" ? Sensor::Model::kGaussian : Sensor::Model::kEmva1288;
  }
  sensor.electrons_per_lux_s = element.number("electronsPerLuxSecond", kPositive);
  sensor.full_well_e = element.number_or("fullWell", sensor.full_well_e, {1, 1e9});
  sensor.read_noise_e = element.number_or("readNoise", sensor.read_noise_e, kNotNegative);
  sensor.prnu = element.number_or("prnu", sensor.prnu, kFraction);
  sensor.dark_e = element.number_or("darkElectrons", sensor.dark_e, kNotNegative);
  return sensor;
}

FlatPort read_port(const XmlElement& element) {
  element.expect({"distance", "thickness", "normal", "indexAir", "indexGlass", "indexWater"});
  FlatPort port;
  port.distance = element.number("distance", {0, 1});
  port.thickness = element.number("thickness", {0, 0.2});
  port.normal = element.has("normal") ? read_direction(element, "normal") : port.normal;
  port.air = element.number_or("indexAir", port.air, {1, 1.1});
  port.glass = element.number_or("indexGlass", port.glass, {1.2, 2.5});
  port.water = element.number_or("indexWater", port.water, {1.2, 1.5});
  return port;
}

CameraModel read_model(const XmlElement& element) {
  CameraModel model;
  model.width = element.has("resw") ? element.integer("resw", {8, 8192}) : 160;
  model.height = element.has("resh") ? element.integer("resh", {8, 8192}) : 120;
  const double fovy = element.number_or("fovy", 50, {1, 170});
  model.cx = (model.width - 1) / 2.0;
  model.cy = (model.height - 1) / 2.0;
  model.fx = model.fy = model.height / 2.0 / std::tan(from_degrees(fovy) / 2);
  if (const auto parameters = element.optional("parameters")) {
    if (const auto angle = element.optional("fovy"))
      angle->fail("found <fovy> beside <parameters>, expected one of them");
    parameters->expect({"fx", "fy", "x0", "y0"}, {}, {"f", "n", "k"});
    model.fx = parameters->number("fx", {1, 1e6});
    model.fy = parameters->number("fy", {1, 1e6});
    model.cx = parameters->number("x0", {-1e5, 1e5});
    model.cy = parameters->number("y0", {-1e5, 1e5});
  }
  if (const auto distortion = element.optional("distortion")) {
    distortion->expect({"k1", "k2", "p1", "p2", "k3"});
    model.k1 = distortion->number_or("k1", 0, {-10, 10});
    model.k2 = distortion->number_or("k2", 0, {-10, 10});
    model.p1 = distortion->number_or("p1", 0, {-1, 1});
    model.p2 = distortion->number_or("p2", 0, {-1, 1});
    model.k3 = distortion->number_or("k3", 0, {-10, 10});
  }
  if (const auto port = element.optional("port")) {
    model.port = read_port(*port);
    if (!model.looks_through_port())
      port->fail(
          "<port>: found pixels that do not look through it, expected a normal along the view, towards the water");
  }
  return model;
}

Transform read_camera_pose(const XmlElement& element, const Scene& scene) {
  const XmlElement reference = element.child("relativeTo");
  const std::string name = reference.text();
  const bool posed = element.has("position") || element.has("orientation") || element.has("quaternion");
  const auto baseline = element.optional("baseline");
  if (baseline && posed) baseline->warn("<baseline> is not used: the camera has a pose of its own");
  if (name == "world" || name == "tank") return element.pose();
  if (name == "kinematic_base") return scene.arm.wMb * element.pose();
  for (const CameraSpec& camera : scene.cameras)
    if (camera.name == name)
      return camera.wMc * (baseline && !posed
                               ? make_transform_rpy({baseline->number({-10, 10}), 0, 0}, Vector3d::Zero())
                               : element.pose());
  reference.fail("<relativeTo>: found '" + name + "', expected world, tank, kinematic_base or an earlier camera");
}

CameraSpec read_camera(const XmlElement& element, const Scene& scene) {
  element.expect({"name", "relativeTo", "resw", "resh", "position", "orientation", "quaternion", "baseline", "fovy",
                  "parameters", "grayscale", "std", "distortion", "port", "rate", "exposure", "psf", "sensor"},
                 {}, {"frameId", "showpath"});
  CameraSpec camera;
  camera.name = element.text("name");
  camera.model = read_model(element);
  camera.wMc = read_camera_pose(element, scene);
  camera.channels = element.flag_or("grayscale", false) ? 1 : 3;
  camera.rate_hz = element.number_or("rate", camera.rate_hz, {0.01, 10000});
  camera.exposure_s = element.number_or("exposure", camera.exposure_s, {1e-6, 10});
  if (camera.exposure_s * camera.rate_hz > 1)
    element.fail("<virtualCamera> '" + camera.name +
                 "': found an exposure longer than the frame, expected at most 1 / rate");
  camera.psf_sigma_px = element.number_or("psf", camera.psf_sigma_px, {0, 10});
  camera.sensor = read_sensor(element.child("sensor"), camera.sensor);
  camera.sensor.gaussian_sd = element.number_or("std", 0, kFraction);
  return camera;
}

LaserLine read_laser(const XmlElement& element) {
  element.expect({"name", "relativeTo", "fov", "laser", "position", "orientation", "quaternion", "luminousFlux",
                  "halfWidth", "divergence", "speckleContrast", "color"},
                 {}, {"image_name"});
  LaserLine laser;
  laser.name = element.text("name");
  const XmlElement reference = element.child("relativeTo");
  if (reference.text() != "end_effector")
    reference.fail("<relativeTo>: found '" + reference.text() + "', expected end_effector");
  if (!element.flag_or("laser", true))
    element.child("laser").fail("<laser>: found 0, expected 1 (a line, not an image)");
  laser.eMl = element.pose();
  laser.fan = from_degrees(element.number("fov", {1, 170}));
  laser.power_lm = element.number_or("luminousFlux", laser.power_lm, kNotNegative);
  laser.half_width = element.number_or("halfWidth", laser.half_width, {1e-6, 0.1});
  laser.divergence = element.number_or("divergence", laser.divergence, {0, 0.5});
  laser.speckle_contrast = element.number_or("speckleContrast", laser.speckle_contrast, kFraction);
  laser.colour = element.rgb_or("color", laser.colour, kFraction);
  return laser;
}

void read_arm(const XmlElement& element, ArmSpec& arm) {
  arm.name = element.text("name");
  arm.wMb = element.pose();
  if (const auto parameters = element.optional("armParameters")) {
    parameters->expect({}, {"link"});
    const auto links = parameters->children("link");
    if (links.size() != arm.model.dh.size())
      parameters->fail(fmt::format("<armParameters>: found {} links, expected 4", links.size()));
    for (std::size_t i = 0; i < links.size(); ++i) {
      links[i].expect({"a", "alpha", "d", "theta0"});
      arm.model.dh[i] = {links[i].number("a", {-5, 5}), links[i].number("alpha", {-7, 7}),
                         links[i].number("d", {-5, 5}), links[i].number("theta0", {-7, 7})};
    }
  }
  if (const auto values = element.optional("jointValues")) {
    values->expect({}, {"joint"});
    const auto joints = values->children("joint");
    if (joints.size() != kJoints)
      values->fail(fmt::format("<jointValues>: found {} joints, expected 5", joints.size()));
    for (int i = 0; i < kJoints; ++i)
      arm.q[i] = joints[i].number({arm.model.limits[i].lower, arm.model.limits[i].upper});
  }
  arm.albedo = element.rgb_or("albedo", arm.albedo, kFraction);
  arm.link_radius = element.number_or("linkRadius", arm.link_radius, {0.001, 0.5});
}

void read_vehicle(const XmlElement& element, Scene& scene) {
  element.expect({"name", "jointValues", "position", "orientation", "quaternion", "structuredLightProjector",
                  "armParameters", "albedo", "linkRadius"},
                 {"virtualCamera"},
                 {"file", "scaleFactor", "virtualRangeImage", "rangeSensor", "imu", "pressureSensor", "gpsSensor",
                  "dvlSensor", "multibeamSensor", "objectPicker", "ForceSensor", "forceSensor", "DredgeTool",
                  "LedArray", "simulatedDynamics", "acousticCommsDevice", "customCommsDevice"});
  read_arm(element, scene.arm);
  scene.laser = read_laser(element.child("structuredLightProjector"));
  for (const XmlElement& camera : element.children("virtualCamera")) {
    const CameraSpec spec = read_camera(camera, scene);
    for (const CameraSpec& other : scene.cameras)
      if (other.name == spec.name)
        camera.child("name").fail("found a second camera called '" + spec.name + "', expected another name");
    scene.cameras.push_back(spec);
  }
}

template <class Item, class Read>
std::vector<Item> read_named(const XmlElement& root, const char* kind, Read read) {
  std::vector<Item> items;
  for (const XmlElement& element : root.children(kind)) {
    items.push_back(read(element));
    for (std::size_t i = 0; i + 1 < items.size(); ++i)
      if (items[i].name == items.back().name)
        element.child("name").fail("found a second " + std::string(kind) + " called '" + items[i].name +
                                   "', expected another name");
  }
  return items;
}

BoardPattern read_pattern(const XmlElement& element) {
  BoardPattern pattern;
  const auto& kinds = kNames<BoardKind>;
  const std::string kind = element.text("pattern");
  const auto found = std::find(kinds.begin(), kinds.end(), kind);
  if (found == kinds.end())
    element.child("pattern").fail("<pattern>: found '" + kind + "', expected " +
                                  fmt::format("{}", fmt::join(kinds, ", ")));
  pattern.kind = static_cast<BoardKind>(found - kinds.begin());
  pattern.columns = element.integer("columns", {1, 100});
  pattern.rows = element.integer("rows", {1, 100});
  pattern.pitch = element.number("pitch", {0.001, 1});
  pattern.marker = element.number_or("marker", 0.75 * pattern.pitch, {0.0005, pattern.pitch});
  pattern.margin = element.number_or("margin", pattern.margin, {0, 1});
  if (element.has("dictionary")) pattern.dictionary = element.text("dictionary");
  if (element.has("firstId")) pattern.first_id = element.integer("firstId", {0, 10000});
  try {
    static_cast<void>(BoardPrint(pattern));
  } catch (const InputError& e) {
    element.child("pattern").fail(std::string("<pattern>: ") + e.what());
  }
  return pattern;
}

BoardShow read_show(const XmlElement& element, const Scene& scene) {
  element.expect({"camera", "count", "nearest", "farthest", "tilt", "seed"});
  BoardShow show;
  show.camera = element.text("camera");
  const auto& cameras = scene.cameras;
  if (std::none_of(cameras.begin(), cameras.end(), [&](const CameraSpec& c) { return c.name == show.camera; }))
    element.child("camera").fail("<camera>: found '" + show.camera + "', expected a camera of the scene");
  show.count = element.integer("count", {1, 1000});
  show.nearest = element.number("nearest", {0.1, 100});
  show.farthest = element.number("farthest", {show.nearest, 100});
  show.tilt = element.number_or("tilt", show.tilt, {0, 1.4});
  if (element.has("seed")) show.seed = static_cast<std::uint64_t>(element.integer("seed", {0, 1e9}));
  return show;
}

BoardSpec read_board(const XmlElement& element, const Scene& scene) {
  element.expect({"name", "pattern", "columns", "rows", "pitch", "marker", "margin", "dictionary", "firstId",
                  "relativeTo", "position", "orientation", "quaternion", "hold"},
                 {"shown"});
  BoardSpec board;
  board.name = element.text("name");
  board.pattern = read_pattern(element);
  for (const XmlElement& shown : element.children("shown")) board.shows.push_back(read_show(shown, scene));
  board.hold = from_seconds(element.number_or("hold", seconds(board.hold), {0.01, 1000}));
  if (!board.shows.empty()) {
    if (const auto place = element.optional("relativeTo"))
      place->fail("found <relativeTo> beside <shown>, expected one of them");
    board.place = BoardSpec::Place::kShown;
    return board;
  }
  const XmlElement reference = element.child("relativeTo");
  const std::string name = reference.text();
  board.pose = element.pose();
  if (name == "kinematic_base") {
    board.pose = scene.arm.wMb * board.pose;
  } else if (name == "end_effector") {
    board.place = BoardSpec::Place::kEndEffector;
  } else if (name != "world" && name != "tank") {
    reference.fail("<relativeTo>: found '" + name + "', expected world, tank, kinematic_base or end_effector");
  }
  return board;
}

void choose_target(const XmlElement& root, std::vector<SceneObject>& objects) {
  if (objects.size() == 1) objects.front().target = true;
  const auto count = std::count_if(objects.begin(), objects.end(), [](const SceneObject& o) { return o.target; });
  if (!objects.empty() && count != 1)
    root.fail(fmt::format("found {} objects with <target>1</target>, expected one", count));
}

}  // namespace

Scene read_scene(const std::filesystem::path& file) {
  const XmlElement root = XmlElement::load(file, "UWSimScene", {"scene", kMostSceneBytes});
  root.expect({"oceanState", "simParams", "tank", "water", "luxMeter", "vehicle"}, {"lamp", "object", "board"},
              {"camera", "nedOrigin", "netTracingScript", "CustomCommsChannel", "AcousticCommsChannel",
               "customCommsChannel", "acousticCommsChannel", "rosInterfaces"});
  Scene scene;
  scene.file = file;
  if (const auto ocean = root.optional("oceanState")) read_ocean(*ocean, scene.water);
  if (const auto simulation = root.optional("simParams")) read_simulation(*simulation, scene);
  if (const auto tank = root.optional("tank")) read_tank(*tank, scene.tank);
  if (const auto water = root.optional("water")) read_water(*water, scene);
  if (scene.tank.water_depth > scene.tank.size.z())
    root.fail("found water deeper than the tank is high, expected <water><depth> at most <tank><size><z>");
  scene.lamps = read_named<Lamp>(root, "lamp", read_lamp);
  scene.objects = read_named<SceneObject>(root, "object", read_object);
  choose_target(root, scene.objects);
  const XmlElement meter = root.child("luxMeter");
  meter.expect({"position", "normal"});
  scene.lux_meter.position = meter.xyz("position");
  if (meter.has("normal")) scene.lux_meter.normal = read_direction(meter, "normal");
  read_vehicle(root.child("vehicle"), scene);
  scene.boards = read_named<BoardSpec>(root, "board", [&](const XmlElement& e) { return read_board(e, scene); });
  scene.warnings = root.warnings();
  return scene;
}

}  // namespace tankrig::sim
