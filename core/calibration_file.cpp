#include "core/calibration_file.hpp"

#include <algorithm>
#include <cmath>

#include "core/input_error.hpp"
#include "core/lens_numbers.hpp"
#include "core/model_yaml.hpp"
#include "core/session_names.hpp"
#include "core/settings_table.hpp"
#include "core/shown_text.hpp"

namespace tankrig {
namespace {

constexpr const char* kFormat = "tankrig-calibration 1";
constexpr ConfigRange kSigma{0, 1e6};

void check_hash(const ConfigNode& node, const char* key, const std::string& text) {
  const bool digits =
      std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  if (text.size() != 64 || !digits)
    node.fail(key, "found '" + shown_text(text) + "', expected the 64 digits of a SHA-256");
}

/// "2026-01-31T12:00:00Z"
void check_utc(const ConfigNode& node, const char* key, const std::string& text) {
  static constexpr char kShape[] = "0000-00-00T00:00:00Z";
  bool fits = text.size() == sizeof kShape - 1;
  for (std::size_t i = 0; fits && i < text.size(); ++i)
    fits = kShape[i] == '0' ? text[i] >= '0' && text[i] <= '9' : text[i] == kShape[i];
  if (!fits) node.fail(key, "found '" + shown_text(text) + "', expected a time like 2026-01-31T12:00:00Z");
}

const Setting<CalibrationSource> kSourceRows[] = {
    {"method", &CalibrationSource::method, "", Need::kRequired},
    {"made_utc", &CalibrationSource::made_utc, "", Need::kRequired},
    {"data", &CalibrationSource::data, "", Need::kRequired},
    {"data_sha256", &CalibrationSource::data_sha256, "", Need::kRequired},
};
void check_source(const ConfigNode& node, const CalibrationSource& source) {
  check_utc(node, "made_utc", source.made_utc);
  check_hash(node, "data_sha256", source.data_sha256);
}
constexpr SettingsTable<CalibrationSource> kSource{kSourceRows, check_source};

const Setting<CalibratedLens> kLensRows[] = {
    {"model", &CalibratedLens::model, kCameraModelKeys, Need::kRequired, YAML::Flow},
    {"sigma", &CalibratedLens::sigma, kSigma, "", Need::kRequired},
    {"rms_px", &CalibratedLens::rms_px, ConfigRange(0, 1e3), "", Need::kRequired},
    {"views", &CalibratedLens::views, ConfigRange(1, 1e6), "", Need::kRequired},
    {"", kSource},
};
void check_lens(const ConfigNode& node, const CalibratedLens& lens) {
  constexpr std::size_t kOfLens = kLensNumbers.size(), kWithPort = kOfLens + 3;
  if (lens.sigma.size() != kOfLens && !(lens.model.port && lens.sigma.size() == kWithPort))
    node.fail("sigma", "found " + std::to_string(lens.sigma.size()) + " numbers, expected " + std::to_string(kOfLens) +
                           ": of fx, fy, cx, cy, k1, k2, p1, p2, k3; behind a port also " + std::to_string(kWithPort) +
                           ": of its distance, and of its normal's x and y over z");
}
constexpr SettingsTable<CalibratedLens> kLens{kLensRows, check_lens};

const Setting<CalibratedMount> kMountRows[] = {
    {"pose", &CalibratedMount::pose, "", Need::kRequired},
    {"sigma_translation_m", &CalibratedMount::sigma_m, kSigma, "", Need::kRequired},
    {"sigma_rotation_rad", &CalibratedMount::sigma_rad, kSigma, "", Need::kRequired},
    {"", kSource},
};
constexpr SettingsTable<CalibratedMount> kMount{kMountRows};

const Setting<CalibratedTime> kTimeRows[] = {
    {"time_offset_s", &CalibratedTime::offset, ConfigRange(-1, 1), "", Need::kRequired},
    {"sigma_s", &CalibratedTime::sigma, ConfigRange(0, 1), "", Need::kRequired},
    {"", kSource},
};
constexpr SettingsTable<CalibratedTime> kTime{kTimeRows};

const Setting<CalibratedJoints> kJointsRows[] = {
    {"theta0_rad", &CalibratedJoints::theta0, ConfigRange(-7, 7), "", Need::kRequired},
    {"sigma_rad", &CalibratedJoints::sigma, kSigma, "", Need::kRequired},
    {"", kSource},
};
constexpr SettingsTable<CalibratedJoints> kJointZeros{kJointsRows};

const Setting<CalibratedLaser> kLaserRows[] = {
    {"ePl", &CalibratedLaser::ePl, "", Need::kRequired},
    {"sigma_rad", &CalibratedLaser::sigma_rad, kSigma, "", Need::kRequired},
    {"sigma_m", &CalibratedLaser::sigma_m, kSigma, "", Need::kRequired},
    {"rms_m", &CalibratedLaser::rms_m, ConfigRange(0, 1), "", Need::kRequired},
    {"", kSource},
};
constexpr SettingsTable<CalibratedLaser> kLaserPlane{kLaserRows};

const Setting<CalibrationCheck> kCheckRows[] = {
    {"name", &CalibrationCheck::name, "", Need::kRequired},
    {"value", &CalibrationCheck::value, "", Need::kRequired},
    {"limit", &CalibrationCheck::limit, "", Need::kRequired},
    {"unit", &CalibrationCheck::unit, "", Need::kRequired},
};
constexpr SettingsTable<CalibrationCheck> kCheck{kCheckRows};

/// A part that may be absent.
template <class S, auto member, const auto& table>
OtherValue<S> optional_part() {
  using Part = typename std::remove_cvref_t<decltype(std::declval<S>().*member)>::value_type;
  return {[](const ConfigNode& n, const char* key, S& s) { s.*member = settings_from<Part>(n.child(key), table); },
          [](YAML::Emitter& out, const S& s) { write_mapping<Part>(out, table, *(s.*member)); }, "", nullptr,
          [](const S& s) { return (s.*member).has_value(); }};
}
template <class S, auto member, const auto& table>
OtherValue<S> list_of() {
  using Item = typename std::remove_cvref_t<decltype(std::declval<S>().*member)>::value_type;
  return {[](const ConfigNode& n, const char* key, S& s) {
            for (const ConfigNode& item : n.items(key)) (s.*member).push_back(settings_from<Item>(item, table));
          },
          [](YAML::Emitter& out, const S& s) {
            out << YAML::BeginSeq;
            for (const Item& item : s.*member) write_mapping<Item>(out, table, item);
            out << YAML::EndSeq;
          },
          "", nullptr, [](const S& s) { return !(s.*member).empty(); }};
}

const Setting<CameraCalibration> kCalibratedPartRows[] = {
    {"name", &CameraCalibration::name, "", Need::kRequired},
    {"lens", optional_part<CameraCalibration, &CameraCalibration::lens, kLens>()},
    {"bMc", optional_part<CameraCalibration, &CameraCalibration::mount, kMount>()},
    {"time", optional_part<CameraCalibration, &CameraCalibration::time, kTime>()},
};
void check_camera(const ConfigNode& node, const CameraCalibration& camera) {
  if (!is_camera_name(camera.name))
    node.fail("name", "found '" + shown_text(camera.name) + "', expected the name of a camera");
}
constexpr SettingsTable<CameraCalibration> kCamera{kCalibratedPartRows, check_camera};

const Setting<Calibration> kRows[] = {
    {"format",
     {[](const ConfigNode& n, const char* key, Calibration&) { static_cast<void>(n.choice(key, {kFormat})); },
      [](YAML::Emitter& out, const Calibration&) { out << kFormat; }, ""},
     "",
     Need::kRequired},
    {"rig", &Calibration::rig, "", Need::kRequired},
    {"rig_sha256", &Calibration::rig_sha256, "", Need::kRequired},
    {"made_utc", &Calibration::made_utc, "", Need::kRequired},
    {"software", &Calibration::software, "", Need::kRequired},
    {"verdict", &Calibration::verdict, "", Need::kRequired},
    {"checks", list_of<Calibration, &Calibration::checks, kCheck>()},
    {"cameras", list_of<Calibration, &Calibration::cameras, kCamera>()},
    {"stereo", optional_part<Calibration, &Calibration::stereo, kMount>()},
    {"joints", optional_part<Calibration, &Calibration::joints, kJointZeros>()},
    {"gripper", optional_part<Calibration, &Calibration::gripper, kMount>()},
    {"laser", optional_part<Calibration, &Calibration::laser, kLaserPlane>()},
    {"object", optional_part<Calibration, &Calibration::object, kMount>()},
};
void check_calibration(const ConfigNode& node, const Calibration& c) {
  check_hash(node, "rig_sha256", c.rig_sha256);
  check_utc(node, "made_utc", c.made_utc);
  for (std::size_t i = 0; i < c.cameras.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (c.cameras[i].name == c.cameras[k].name)
        node.fail("cameras", "found '" + shown_text(c.cameras[i].name) + "' twice, expected every camera once");
  if (c.verdict == CalibrationVerdict::kAccepted && (c.checks.empty() || !all_passed(c.checks)))
    node.fail("verdict", "found accepted beside " +
                             std::string(c.checks.empty() ? "no checks" : "a check that failed") +
                             ", expected checks that passed");
}
constexpr SettingsTable<Calibration> kCalibration{kRows, check_calibration};

}  // namespace

bool all_passed(const std::vector<CalibrationCheck>& checks) {
  return std::all_of(checks.begin(), checks.end(), [](const CalibrationCheck& c) { return c.passed(); });
}

const CameraCalibration* Calibration::camera(const std::string& name) const {
  for (const CameraCalibration& camera : cameras)
    if (camera.name == name) return &camera;
  return nullptr;
}

CameraCalibration& Calibration::camera(const std::string& name) {
  for (CameraCalibration& camera : cameras)
    if (camera.name == name) return camera;
  cameras.push_back({name, {}, {}, {}});
  return cameras.back();
}

Calibration read_calibration(const std::filesystem::path& file) {
  return settings_from(ConfigNode::load(file), kCalibration);
}

Calibration parse_calibration(const std::string& text, const std::filesystem::path& file) {
  return settings_from(ConfigNode::parse(text, file), kCalibration);
}

std::string calibration_text(const Calibration& calibration) {
  YAML::Emitter out;
  out << YAML::Comment("What was measured of the rig. Sigmas are one standard deviation.");
  write_mapping(out, kCalibration, calibration);
  return std::string(out.c_str()) + "\n";
}

}  // namespace tankrig
