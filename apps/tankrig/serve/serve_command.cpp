// `tankrig serve`: the operator's console in a browser. What the page may start is said here.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/command_line/stop.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/devices/world_options.hpp"
#include "apps/tankrig/scan/record_session.hpp"
#include "apps/tankrig/scan/used_calibration.hpp"
#include "apps/tankrig/serve/click_corners.hpp"
#include "apps/tankrig/serve/listen_options.hpp"
#include "apps/tankrig/serve/score_upload.hpp"
#include "apps/tankrig/serve/serve_platform.hpp"
#include "console/server/console.hpp"
#include "core/angles.hpp"
#include "core/input_error.hpp"
#include "rig/config/rig_config.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

using nlohmann::ordered_json;

struct ServeOptions {
  std::string rig = "tank-sim";
  ListenCommand listen;
  PlatformCommand platform;
};

constexpr char kMakeSafe[] = "make_safe", kCalibrate[] = "calibrate";
constexpr double kNoLimit = std::numeric_limits<double>::infinity();
// Where `tankrig scan`, `bench` and `experiment` put what they make.
constexpr char kSessions[] = "sessions", kBenchmarks[] = "benchmarks", kExperiments[] = "experiments";

std::vector<std::string> presets_of(const RigConfig& rig) {
  const auto presets = rig.root.optional_child("presets");
  return presets ? presets->keys() : std::vector<std::string>{};
}

/// The benchmark files that come with the program, beside its rigs, and those of this folder.
std::vector<std::string> benchmark_files() {
  std::vector<std::string> files;
  std::error_code none;
  for (const fs::path& folder : {find_rig("tank-sim").parent_path() / "../../benchmarks", fs::path(kBenchmarks)})
    for (const auto& entry : fs::directory_iterator(folder, none))
      if (entry.path().extension() == ".xml") files.push_back(entry.path().lexically_normal().string());
  std::ranges::sort(files);
  return files;
}

/// The option is called like its key.
RunField number(const std::string& key, const std::string& label, const std::string& help, const ConfigRange& range) {
  return {key, label, "--" + key, FieldKind::kNumber, {}, help, false, range};
}

std::vector<RunField> scan_fields(const RigConfig& rig) {
  std::vector<RunField> fields;
  if (const auto presets = presets_of(rig); !presets.empty())
    fields.push_back({"preset", "Preset", "--preset", FieldKind::kChoice, presets});
  if (!rig.scene.empty()) {
    fields.push_back(number("light", "Light", "0 is darkness, 1 the reference", kLightRange));
    fields.push_back(
        number("noise", "Noise", fmt::format("a share of full scale, at most {:g}", kNoiseRange.upper), kNoiseRange));
    fields.push_back({"sensor", "Sensor", "--sensor", FieldKind::kChoice, kSensors});
    fields.push_back(number("seed", "Seed", "", {0, kNoLimit}));
    fields.back().whole = true;
  }
  fields.push_back(number("lux", "Ambient light [lx]", "empty: the lux meter is read", kLuxRange));
  fields.push_back({"operator", "Operator", "--operator"});
  fields.push_back({"notes", "Notes", "--notes"});
  return fields;
}

/// `name`: as it is typed.
std::vector<OfferedCommand> offered(const std::string& name, const RigConfig& rig) {
  const auto on_rig = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--rig", name});
    return words;
  };
  std::vector<std::string> cameras, joints(kJointNames.begin(), kJointNames.end());
  for (const RigCamera& camera : rig.cameras) cameras.push_back(camera.name);
  std::vector<OfferedCommand> all{
      {"scan", "Scan", "Sweeps the arm, records a session, reconstructs and scores it.", on_rig({"scan"}),
       scan_fields(rig), false, true},
      {"preview",
       "Look through a camera",
       "Shows focus, clipped pixels and histogram; nothing moves or shines.",
       on_rig({"camera", "preview", "--seconds", "600"}),
       {{"camera", "Camera", "--camera", FieldKind::kChoice, cameras}}},
      {"lit",
       "Look at the stripe",
       "Switches the laser on for 30 s with the arm at rest, and marks its stripe.",
       on_rig({"camera", "preview", "--laser", "--seconds", "30"}),
       {{"camera", "Camera", "--camera", FieldKind::kChoice, cameras}},
       false,
       true},
      {"jog",
       "Jog",
       "Moves one joint by an angle, while the button is held.",
       on_rig({"arm", "jog", "--relative"}),
       {{"joint", "Joint", "", FieldKind::kWord, joints, "", true},
        {"angle", "By [deg]", "", FieldKind::kWord, {}, "", true}},
       true,
       true},
      {"park", "Park", "Moves all joints to the park posture.", on_rig({"arm", "park"}), {}, false, true},
      {"home",
       "Home",
       "Drives the joints into their stops to find the encoders' zeros.",
       on_rig({"arm", "home"}),
       {},
       false,
       true},
      {kMakeSafe,
       "Laser off, arm at rest",
       "Switches the laser off, brings the arm to rest, and says whether both are confirmed.",
       on_rig({"arm", "stop"}),
       {}},
      {kCalibrate,
       "Calibrate",
       "The whole rig, step by step: it says what to do and waits for an answer.",
       on_rig({"calibrate", "all", "--data", std::string(kSessions) + "/calibration-" + rig.name}),
       {{"operator", "Operator", "--operator"}},
       false,
       true}};
  const RunField session{"session", "Session", kSessions, FieldKind::kFolder, {}, "", true};
  all.push_back({"report", "Report", "Reconstructs and scores a session anew.", {"report"}, {session}});
  all.push_back({"check", "Check", "Says what a session has lost.", {"session", "check"}, {session}});
  all.push_back({"recover",
                 "Recover",
                 "Rescues a session after a kill, a full disk or a power cut.",
                 {"session", "recover"},
                 {session}});
  if (const auto files = benchmark_files(); !files.empty()) {
    const RunField file{"file", "Benchmark file", "", FieldKind::kWord, files, "", true};
    all.push_back({"experiment",
                   "Experiment",
                   "A session at each light level of a benchmark file; it asks for the levels.",
                   on_rig({"experiment"}),
                   {file, {"operator", "Operator", "--operator"}},
                   false,
                   true});
    all.push_back({"bench",
                   "Benchmark",
                   "Sweeps light and noise in the simulated tank; moves no device.",
                   rig.scene.empty() ? std::vector<std::string>{"bench"} : on_rig({"bench"}),
                   {file}});
  }
  return all;
}

ordered_json joints_of(const RigConfig& rig) {
  ordered_json joints = ordered_json::array();
  for (int j = 0; j < kJoints; ++j)
    joints.push_back({{"name", kJointNames[j]},
                      {"lower_deg", to_degrees(rig.arm.limits[j].lower)},
                      {"upper_deg", to_degrees(rig.arm.limits[j].upper)}});
  return joints;
}

ordered_json facts_of(const RigConfig& rig) {
  return {{"name", rig.name},
          {"description", rig.description},
          {"version", TANKRIG_VERSION},
          {"calibration", rig.calibration ? rig.calibration_file.filename().string() : "none: the rig file's values"},
          {"calibration_made_utc", rig.calibration ? ordered_json(rig.calibration->values.made_utc) : ordered_json()},
          {"calibration_verdict",
           rig.calibration ? ordered_json(name_of(rig.calibration->values.verdict)) : ordered_json()},
          {"warnings", calibration_warnings(rig)},
          {"click", corners_to_click(rig)},
          {"joints", joints_of(rig)}};
}

ConsoleRig rig_of_page(const std::string& name) {
  const RigConfig rig = load_rig(find_rig(name));
  ConsoleRig out{facts_of(rig),
                 offered(name, rig),
                 {{"sessions", {"session", "list", kSessions, "--json"}},
                  {"arm", {"arm", "status", "--rig", name, "--json"}},
                  {"doctor", {"doctor", "--rig", name, "--json"}},
                  {"plan", {"scan", "--dry-run", "--rig", name, "--json"}},
                  {"path", {"scan", "--dry-run", "--rig", name, "--json", "--draw"}}}};
  for (const std::string& preset : presets_of(rig)) {
    std::vector<std::string>& words = out.questions["path/" + preset];
    words = out.questions.at("path");
    words.insert(words.end(), {"--preset", preset});
  }
  return out;
}

int serve(const ServeOptions& options) {
  ListenOptions listen;
  try {
    listen = listen_options(options.listen);
  } catch (const InputError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return kUsage;
  }
  if (options.platform.on) return run_platform(options.platform, listen);
  ConsoleOptions console;
  console.program = fs::read_symlink("/proc/self/exe").string();
  console.rigs = {options.rig};
  for (const std::string& name : known_rigs())
    if (name != options.rig) console.rigs.push_back(name);
  std::string chosen;
  console.rig = [&chosen](const std::string& name) {
    ConsoleRig rig = rig_of_page(name);
    chosen = name;
    return rig;
  };
  console.sessions = kSessions;
  for (const char* folder : {kBenchmarks, kExperiments}) console.results[folder] = folder;
  console.wishes = {
      {"corners", [&chosen](const ordered_json& wish) { return save_clicked_corners(kSessions, chosen, wish); }}};
  console.listen = listen;
  console.make_safe = kMakeSafe;
  console.calibrates = kCalibrate;
  console.kept = {"arm", "doctor"};
  fs::create_directories(kSessions);
  const StopOnSignal stop_on_signal;
  const auto first = StopOnSignal::from_now_on();
  std::function<bool()> second;
  serve_console(
      console,
      [&](const std::string& address) {
        fmt::print("The console is at {}\nIt is for {}. Ctrl-C ends it, and stops what runs.\n", address,
                   listen.users.empty() ? "browsers on this machine" : "the users of " + listen.users.string());
        std::fflush(stdout);
      },
      [&] {
        if (!first()) return 0;
        if (!second) second = StopOnSignal::from_now_on();
        return second() ? 2 : 1;
      });
  return kOk;
}

}  // namespace

void add_serve(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("serve", "The operator's console: the rig in a browser");
  const auto options = std::make_shared<ServeOptions>();
  c->require_subcommand(0, 1);
  ServeOptions& o = *options;
  c->callback([options, &chosen, c] {  // which CLI11 calls after that of a command below it
    if (c->get_subcommands().empty()) chosen = [options] { return serve(*options); };
  });
  c->footer(
      "The page starts commands of this program, and stops them as Ctrl-C does. It is no emergency stop.\n"
      "Example: tankrig serve --rig tank-wire    (then open the address that it prints)");
  add_rig_option(c, o.rig);
  add_listen_options(*c, o.listen);
  add_user(*c, chosen);
  add_platform_options(*c, o.platform);
  add_score(*c, chosen);
  add_publish(*c, chosen);
}

}  // namespace tankrig::app
