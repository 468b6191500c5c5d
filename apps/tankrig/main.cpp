// tankrig: the command line. What each command does is in its own file.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>

#include "apps/tankrig/arm_commands.hpp"
#include "apps/tankrig/calibrate.hpp"
#include "apps/tankrig/camera_commands.hpp"
#include "apps/tankrig/commands.hpp"
#include "apps/tankrig/doctor.hpp"
#include "apps/tankrig/emulate.hpp"
#include "apps/tankrig/output.hpp"
#include "apps/tankrig/session_check.hpp"
#include "apps/tankrig/session_export.hpp"
#include "apps/tankrig/session_replay.hpp"
#include "core/input_error.hpp"

using namespace tankrig::app;

namespace {

void add_scan(CLI::App& app, ScanOptions& o) {
  CLI::App* c = app.add_subcommand("scan", "Sweep the arm, record a session, reconstruct, score, report");
  c->footer("Example: tankrig scan --rig tank-sim --light 0.5 --noise 0.02 --json");
  c->add_option("--rig", o.rig, "Rig name below etc/rigs, or a rig.yaml")->capture_default_str();
  c->add_option("--preset", o.preset, "Preset of the rig file, e.g. fine");
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
  c->add_option("--faults", o.faults, "Play this fault plan on simulated or emulated devices (docs/faults.md)")
      ->check(CLI::ExistingFile);
  c->add_option("--operator", o.operator_name, "Who runs the experiment");
  c->add_option("--notes", o.notes, "Free text kept in the session");
  c->add_option("--out", o.out, "Session directory, which must not exist (default: sessions/RIG-DATE)");
  c->add_flag("--dry-run", o.dry_run, "Print path, clearance, duration and disk need; move nothing");
  c->add_flag("--json", o.json, "Print one JSON object on standard output");
}

void add_reconstruct(CLI::App& app, ReconstructOptions& o) {
  CLI::App* c = app.add_subcommand("reconstruct", "Make a point cloud from a session");
  c->footer("Example: tankrig reconstruct sessions/monday --method laser --json");
  c->add_option("session", o.session, "Session directory")->required();
  c->add_option("--method", o.method, "Method")
      ->check(CLI::IsMember({"laser", "laser_paper", "stereo", "stereo_paper"}))
      ->capture_default_str();
  c->add_option("--rig", o.rig, "Take reconstruction parameters from this rig file instead of the session's");
  c->add_option("--out", o.out, "Cloud to write, .ply or .pcd (default: both, in SESSION/clouds)");
  c->add_flag("--json", o.json, "Print one JSON object on standard output");
}

void add_evaluate(CLI::App& app, EvaluateOptions& o) {
  CLI::App* c = app.add_subcommand("evaluate", "Score a point cloud against a triangle mesh");
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

void add_session(CLI::App& app, ImportOptions& import, SessionInfoOptions& info) {
  CLI::App* session = app.add_subcommand("session", "Look into sessions, and make them from other scanners' images");
  session->require_subcommand(1);
  session->footer("Example: tankrig session info sessions/monday");
  CLI::App* c = session->add_subcommand(
      "import", "Make a session from a folder of stripe images, a camera file and the laser plane");
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
  c->footer("Example: tankrig session info sessions/monday --json");
  c->add_option("session", info.session, "Session directory")->required();
  c->add_flag("--json", info.json, "Print one JSON object on standard output");
}

void add_report(CLI::App& app, ReportOptions& o) {
  CLI::App* c =
      app.add_subcommand("report", "Reconstruct and score a session again, and write its pictures and report.html");
  c->footer("Example: tankrig report sessions/monday");
  c->add_option("session", o.session, "Session directory")->required();
  c->add_flag("--json", o.json, "Print one JSON object on standard output");
}

void add_init(CLI::App& app, InitOptions& o) {
  CLI::App* c = app.add_subcommand("init", "Write a commented rig to start from: rig file, scene and object");
  c->footer("Example: tankrig init my-rig && tankrig scan --rig my-rig/rig.yaml");
  c->add_option("directory", o.directory, "Folder to make")->required();
  c->add_option("--from", o.from, "Rig to start from")->capture_default_str();
}

}  // namespace

int main(int argc, char** argv) {
  // A closed terminal or pager, or a file that may not grow, must not end a program that has an arm to stop.
  for (const int signal : {SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
  CLI::App app{"tankrig: laser-stripe and stereo reconstruction in a water tank, on the real rig and in simulation"};
  app.require_subcommand(1);
  app.set_version_flag("--version", TANKRIG_VERSION);
  app.footer("Example: tankrig scan            (the simulated tank, from sweep to report)");
  ScanOptions scan_options;
  ReconstructOptions reconstruct_options;
  EvaluateOptions evaluate_options;
  ImportOptions import_options;
  SessionInfoOptions info_options;
  SessionCheckOptions check_options;
  SessionRecoverOptions recover_options;
  SessionReplayOptions replay_options;
  SessionExportOptions export_options;
  DoctorOptions doctor_options;
  ReportOptions report_options;
  InitOptions init_options;
  ArmCommandOptions arm_options;
  CameraPreviewOptions preview_options;
  EmulateOptions emulate_options;
  CalibrateTimeOptions calibrate_time_options;
  add_scan(app, scan_options);
  add_reconstruct(app, reconstruct_options);
  add_evaluate(app, evaluate_options);
  add_session(app, import_options, info_options);
  CLI::App& session = *app.get_subcommand("session");
  add_session_check(session, check_options, recover_options);
  add_session_replay(session, replay_options);
  add_session_export(session, export_options);
  add_report(app, report_options);
  add_doctor(app, doctor_options);
  add_init(app, init_options);
  add_arm(app, arm_options);
  add_camera(app, preview_options);
  add_emulate(app, emulate_options);
  add_calibrate(app, calibrate_time_options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }
  const auto run = [&] {
    if (app.got_subcommand("scan")) return scan(scan_options);
    if (app.got_subcommand("reconstruct")) return reconstruct(reconstruct_options);
    if (app.got_subcommand("evaluate")) return evaluate(evaluate_options);
    if (app.got_subcommand("report")) return report(report_options);
    if (app.got_subcommand("init")) return init(init_options);
    if (app.got_subcommand("arm")) return arm_options.run(arm_options);
    if (app.got_subcommand("camera")) return camera_preview(preview_options);
    if (app.got_subcommand("doctor")) return doctor(doctor_options);
    if (app.got_subcommand("emulate")) return emulate(emulate_options);
    if (app.got_subcommand("calibrate")) return calibrate_time(calibrate_time_options);
    if (session.got_subcommand("import")) return import_session(import_options);
    if (session.got_subcommand("check")) return check_session(check_options);
    if (session.got_subcommand("recover")) return recover_session(recover_options);
    if (session.got_subcommand("replay")) return replay_session(replay_options);
    if (session.got_subcommand("export")) return export_session(export_options);
    return session_info(info_options);
  };
  try {
    return flush_output(run());
  } catch (const std::filesystem::filesystem_error& e) {
    std::fprintf(stderr, "tankrig: %s: %s\n", e.path1().c_str(), e.code().message().c_str());
    return kFailure;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "tankrig: %s\n", e.what());
    return kFailure;
  }
}
