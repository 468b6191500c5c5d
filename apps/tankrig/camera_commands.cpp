#include "apps/tankrig/camera_commands.hpp"

namespace tankrig::app {

void add_camera(CLI::App& app, ChosenCommand& chosen) {
  CLI::App* camera = app.add_subcommand("camera", "Look through a camera");
  camera->require_subcommand(1);
  camera->footer("Example: tankrig camera preview --rig tank-sim --camera mono");
  CLI::App* c = camera->add_subcommand(
      "preview",
      "Write a picture again and again: focus, clipped pixels, histogram, and the stripe if the laser is on");
  CameraPreviewOptions& o = options_of(c, chosen, &camera_preview);
  c->footer(
      "Example: tankrig camera preview --rig tank-sim --out preview.png    (then open preview.html in a browser)");
  c->add_option("--rig", o.rig, "Rig name below etc/rigs, or a rig.yaml")->capture_default_str();
  c->add_option("--camera", o.camera, "Camera of the rig file (default: its first)");
  c->add_option("--out", o.out, "Picture to refresh, .png; a page that shows it live is written beside it, .html")
      ->capture_default_str();
  c->add_option(
       "--seconds", o.seconds,
       "How long (default: until Ctrl-C; 2 s of a virtual clock; 30 s with the laser, where 120 s is the most)")
      ->check(CLI::PositiveNumber);
  c->add_option("--rate", o.rate_hz, "Refreshes per second, at most [Hz]")
      ->check(CLI::Range(0.1, 30.0))
      ->capture_default_str();
  c->add_flag("--laser", o.laser, "Switch the laser on, arm at rest, and mark its stripe; it asks first");
  c->add_flag("--yes", o.yes, "Do not ask before the laser shines");
  c->add_flag("--json", o.json, "Print one JSON object on standard output at the end");
}

}  // namespace tankrig::app
