// tankrig: the command line. What each command does is in its own file.
#include <csignal>
#include <cstdio>
#include <exception>

#include "apps/tankrig/arm_commands.hpp"
#include "apps/tankrig/calibrate.hpp"
#include "apps/tankrig/camera_commands.hpp"
#include "apps/tankrig/command_line.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/doctor.hpp"
#include "apps/tankrig/emulate.hpp"
#include "apps/tankrig/open_session.hpp"
#include "apps/tankrig/output.hpp"
#include "apps/tankrig/session_check.hpp"
#include "apps/tankrig/session_export.hpp"
#include "apps/tankrig/session_replay.hpp"
#include "apps/tankrig/stop.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"
#include "pipeline/reconstruct_session.hpp"

using namespace tankrig::app;

namespace {

void add_scan(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("scan", "Sweep the arm, record a session, reconstruct, score, report");
  ScanOptions& o = options_of(c, chosen, &scan);
  c->footer(
      "Exit code: 0 done; 3 in part: stopped, or frames are missing; 1 failed; 2 wrong words on the command line.\n"
      "Example: tankrig scan --rig tank-sim --light 0.5 --noise 0.02 --json");
  c->add_option("--rig", o.rig, "Rig name below etc/rigs, or a rig.yaml")->capture_default_str();
  c->add_option("--preset", o.preset, "Preset of the rig file; tank-sim and tank-wire have: fine");
  c->add_option("--light", o.light, "Simulated ambient light, 0 darkness .. 1 the reference")
      ->check(CLI::Range(0.0, 1.0));
  c->add_option("--noise", o.noise, "Simulated camera noise, standard deviation 0 .. 0.10 of full scale")
      ->check(CLI::Range(0.0, 0.1));
  c->add_option("--sensor", o.sensor, "Simulated sensor model")->check(CLI::IsMember({"gaussian", "emva1288"}));
  c->add_option("--particles", o.particles, "Floating particles per cubic metre")->check(CLI::Range(0.0, 1e5));
  c->add_option("--seed", o.seed, "Seed of every random number")->capture_default_str();
  c->add_option("--lux", o.lux, "'auto' reads the lux meter before and after the sweep; or a value by hand [lx]")
      ->capture_default_str();
  c->add_option("--carrier", o.carrier, "The arm's wire on a rig with devices (default: the rig file's)")
      ->check(CLI::IsMember({"can", "serial"}));
  c->add_option("--faults", o.faults,
                "Play this fault plan on simulated or emulated devices (docs/reference/faults.md)")
      ->check(CLI::ExistingFile);
  c->add_option("--operator", o.operator_name, "Who runs the experiment");
  c->add_option("--notes", o.notes, "Free text kept in the session");
  c->add_option("--out", o.out, "Session directory, which must not exist (default: sessions/RIG-DATE)");
  c->add_flag("--dry-run", o.dry_run,
              "Print the path from the park posture, clearance, duration and disk need; uses no devices");
  c->add_flag("--json", o.json, "Print one JSON object on standard output");
}

void add_reconstruct(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("reconstruct", "Make a point cloud from a session");
  ReconstructOptions& o = options_of(c, chosen, &reconstruct);
  c->footer("Example: tankrig reconstruct sessions/monday --method laser --json");
  add_session_option(c, o.session);
  c->add_option("--method", o.method, "Method")->check(CLI::IsMember(tankrig::kMethods))->capture_default_str();
  c->add_option("--rig", o.rig, "Take reconstruction parameters from this rig file instead of the session's");
  c->add_option("--out", o.out, "Cloud to write, .ply or .pcd (default: both, in SESSION/clouds)");
  c->add_flag("--json", o.json, "Print one JSON object on standard output");
}

void add_evaluate(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("evaluate", "Score a point cloud against a triangle mesh");
  EvaluateOptions& o = options_of(c, chosen, &evaluate);
  c->footer("Example: tankrig evaluate cloud.ply --object box.obj --pose pose.yaml --json");
  c->add_option("cloud", o.cloud, "Cloud, .ply or .pcd, metres")->required();
  c->add_option("--object", o.object, "Triangle mesh of the object, metres")->required();
  c->add_option("--pose", o.pose, "YAML with translation_m and quaternion_xyzw of the mesh's frame in the cloud's")
      ->required();
  c->add_option("--definition", o.definition, "'paper': the paper's words; 'uwsim': the reference module's arithmetic")
      ->check(CLI::IsMember({"paper", "uwsim"}))
      ->capture_default_str();
  c->add_option("--inlier", o.inlier_m, "Inlier threshold [m] (default 0.010)")->check(CLI::PositiveNumber);
  c->add_option("--outlier", o.outlier_m, "Outlier threshold [m] (default 0.010)")->check(CLI::PositiveNumber);
  c->add_option("--ground", o.ground_m,
                "Half height of the ground filter about the mesh's lowest point [m] (default 0.010)")
      ->check(CLI::NonNegativeNumber);
  c->add_option("--ground-plane", o.ground_plane,
                "Ground a,b,c,d in the object's frame, metres (default: z_o = the mesh's lowest point, z_o up)");
  c->add_option("--verdict", o.verdict, "Write the cloud coloured: ground black, object green, outliers blue (.ply)");
  c->add_flag("--json", o.json, "Print one JSON object on standard output");
}

void add_session(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* session = app.add_subcommand("session", "Look into sessions, and make them from other scanners' images");
  session->require_subcommand(1);
  session->footer("Example: tankrig session info sessions/monday");
  CLI::App* c = session->add_subcommand(
      "import", "Make a session from a folder of stripe images, a camera file and the laser plane");
  ImportOptions& import = options_of(c, chosen, &import_session);
  c->footer(
      "Example: tankrig session import --images photos --camera camera.yaml --plane 0.99989,0.01415,0.00503,0.03952 "
      "--out sessions/imported");
  c->add_option("--images", import.images, "Folder of images, taken in the order of their names")->required();
  c->add_option("--camera", import.camera, "OpenCV calibration or ROS camera_info YAML")->required();
  CLI::Option* plane =
      c->add_option("--plane", import.plane, "Laser plane a,b,c,d: ax + by + cz + d = 0, camera frame, metres");
  c->add_option("--planes", import.planes, "CSV file,a,b,c,d: one plane per image")->excludes(plane);
  c->add_option("--dark", import.dark, "Folder of images without laser");
  c->add_option("--notes", import.notes, "Free text kept in the session");
  c->add_option("--out", import.out, "Session directory, which must not exist")->required();
  c->add_flag("--json", import.json, "Print one JSON object on standard output");
  c = session->add_subcommand("info", "Print what a session holds");
  SessionInfoOptions& info = options_of(c, chosen, &session_info);
  c->footer("Example: tankrig session info sessions/monday --json");
  add_session_option(c, info.session);
  c->add_flag("--json", info.json, "Print one JSON object on standard output");
  c = session->add_subcommand("list", "List the sessions in a folder, oldest first: when, which rig, lux, who, status");
  SessionListOptions& list = options_of(c, chosen, &session_list);
  c->footer("Example: tankrig session list --rig tank-sim");
  c->add_option("folder", list.folder, "Folder of sessions")->capture_default_str();
  c->add_option("--rig", list.rig, "Only those of this rig");
  c->add_flag("--json", list.json, "Print one JSON array on standard output");
  add_session_check(*session, chosen);
  add_session_replay(*session, chosen);
  add_session_export(*session, chosen);
}

void add_report(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c =
      app.add_subcommand("report", "Reconstruct and score a session again, and write its pictures and report.html");
  ReportOptions& o = options_of(c, chosen, &report);
  c->footer("Example: tankrig report sessions/monday");
  add_session_option(c, o.session);
  c->add_flag("--json", o.json, "Print one JSON object on standard output");
}

void add_init(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* c = app.add_subcommand("init", "Write a commented rig to start from: rig file, scene and object");
  InitOptions& o = options_of(c, chosen, &init);
  c->footer("Example: tankrig init my-rig && tankrig scan --rig my-rig/rig.yaml");
  auto* what = c->add_option_group("what");
  what->add_option("directory", o.directory, "Folder to make");
  what->add_flag("--keys", o.keys, "Print every key of a rig file: default, range, meaning");
  what->require_option(1);
  c->add_option("--from", o.from, "Rig to start from")->capture_default_str();
}

/// Something required is missing: a word that stands where a command was expected is named beside those there are, an
/// option that nobody knows before one that is missing.
int unknown_or_missing(const CLI::App& app, const CLI::RequiredError& missing) {
  const CLI::App* parent = &app;
  std::string name = "tankrig", known;
  while (!parent->get_subcommands().empty()) {
    parent = parent->get_subcommands().front();
    name += " " + parent->get_name();
  }
  for (const CLI::App* command : parent->get_subcommands([](const CLI::App*) { return true; }))
    if (!command->get_name().empty()) known += (known.empty() ? "" : ", ") + command->get_name();
  const std::vector<std::string> words = app.remaining(true);
  if (!words.empty() && words.front().starts_with('-'))
    app.exit(CLI::ExtrasError(std::vector{tankrig::shown_text(words.front())}));
  else if (words.empty() || known.empty())
    app.exit(missing);
  else
    std::fprintf(stderr, "%s: found '%s', expected a command, one of: %s\n", name.c_str(),
                 tankrig::shown_text(words.front()).c_str(), known.c_str());
  return kUsage;
}

}  // namespace

int main(int argc, char** argv) {
  // A closed terminal or pager, or a file that may not grow, must not end a program that has an arm to stop.
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
  CLI::App app{"tankrig: laser-stripe and stereo reconstruction in a water tank, on the real rig and in simulation"};
  app.require_subcommand(1);
  app.set_version_flag("--version", TANKRIG_VERSION);
  app.footer("Example: tankrig scan            (the simulated tank, from sweep to report)");
  ChosenCommand chosen;
  for (const auto add : {add_scan, add_reconstruct, add_evaluate, add_session, add_report, add_doctor, add_init,
                         add_arm, add_camera, add_emulate, add_calibrate})
    add(app, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::RequiredError& e) {
    return unknown_or_missing(app, e);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }
  try {
    return flush_output(chosen());
  } catch (const StoppedEarly& e) {
    std::fprintf(stderr, "tankrig: %s\n", tankrig::printable(e.what()).c_str());
    return kPartial;
  } catch (const std::filesystem::filesystem_error& e) {
    std::fprintf(stderr, "tankrig: %s: %s\n", tankrig::printable(e.path1().string()).c_str(),
                 e.code().message().c_str());
    return kFailure;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "tankrig: %s\n", tankrig::printable(e.what()).c_str());
    return kFailure;
  }
}
