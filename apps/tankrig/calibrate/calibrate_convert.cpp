// `tankrig calibrate convert`: camera files from one format of the field to another.

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/tankrig/calibrate/calibrate_commands.hpp"
#include "apps/tankrig/calibrate/camera_files.hpp"
#include "apps/tankrig/command_line/output.hpp"
#include "apps/tankrig/command_line/progress.hpp"
#include "core/input_error.hpp"
#include "core/shown_text.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

struct ConvertOptions {
  fs::path in, out;
  std::string camera;
  CameraFileFormatOption format;
  bool json = false;
};

/// What `format` has no place for besides the lens, in words.
void note_what_is_left_out(const std::vector<FileCamera>& cameras, CameraFileFormat format, Progress& progress) {
  const bool places = format == CameraFileFormat::kKalibr || format == CameraFileFormat::kMrcal;
  for (const FileCamera& camera : cameras) {
    const bool first_of_chain = format == CameraFileFormat::kKalibr && &camera == &cameras.front();
    if (camera.cMr && !camera.cMr->isApprox(Transform::Identity()) && (!places || first_of_chain))
      progress.note(shown_text(camera.name) + ": its place is left out: the new file has no room for it");
    if (camera.rectification && format != CameraFileFormat::kRos)
      progress.note(shown_text(camera.name) + ": its rectification is left out: only ROS files have one");
  }
}

int convert(const ConvertOptions& options) {
  Progress progress;
  std::vector<FileCamera> cameras = read_camera_file_whole(options.in);
  if (!options.camera.empty()) {
    std::string names;
    for (const FileCamera& camera : cameras) names += (names.empty() ? "" : ", ") + shown_text(camera.name);
    std::erase_if(cameras, [&](const FileCamera& camera) { return camera.name != options.camera; });
    if (cameras.empty())
      throw InputError(options.in, "holds no camera " + shown_text(options.camera) + ", expected one of " + names);
  }
  const CameraFileFormat format = options.format.of(options.out);
  write_camera_file(options.out, format, cameras);
  note_what_is_left_out(cameras, format, progress);
  nlohmann::ordered_json facts{{"out", options.out.string()}, {"format", name_of(format)}};
  for (const FileCamera& camera : cameras) facts["cameras"].push_back(camera.name);
  if (options.json)
    print_json(facts);
  else
    fmt::print("{}: {} of {} x {} px, format {}\n", printable(options.out.string()),
               cameras.size() == 1 ? "one camera" : fmt::format("{} cameras", cameras.size()),
               cameras.front().model.width, cameras.front().model.height, name_of(format));
  return kOk;
}

}  // namespace

void add_calibrate_convert(CLI::App& calibrate, ChosenCommand& chosen) {
  CLI::App* c = calibrate.add_subcommand(
      "convert", "Turn a camera file of one program into another's: OpenCV, ROS, Kalibr, mrcal, ViSP");
  ConvertOptions& o = options_of(c, chosen, &convert);
  c->footer("Example: tankrig calibrate convert camchain.yaml right.cameramodel --camera cam1");
  c->add_option("in", o.in, "Camera file; its content tells the format")->required();
  c->add_option("out", o.out, "Camera file to write")->required();
  c->add_option("--camera", o.camera, "Only this camera of a file with several");
  add_camera_format_option(c, o.format);
  add_json_flag(c, o.json);
}

}  // namespace tankrig::app
