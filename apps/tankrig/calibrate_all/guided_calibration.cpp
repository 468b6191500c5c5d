#include "apps/tankrig/calibrate_all/guided_calibration.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "apps/tankrig/calibrate/camera_pictures.hpp"
#include "apps/tankrig/calibrate/dark_frames.hpp"
#include "apps/tankrig/calibrate/marker_postures.hpp"
#include "apps/tankrig/calibrate/object_picture.hpp"
#include "apps/tankrig/calibrate/time_data.hpp"
#include "apps/tankrig/calibrate_all/board_count.hpp"
#include "apps/tankrig/calibrate_all/calibration_page.hpp"
#include "apps/tankrig/calibrate_all/held_back_checks.hpp"
#include "apps/tankrig/calibrate_all/picture_judges.hpp"
#include "apps/tankrig/calibrate_all/simulated_operator.hpp"
#include "apps/tankrig/calibrate_all/step_session.hpp"
#include "apps/tankrig/command_line/confirm.hpp"
#include "apps/tankrig/command_line/rig_files.hpp"
#include "apps/tankrig/devices/scene_check.hpp"
#include "apps/tankrig/scan/recorded_session.hpp"
#include "bench/metrics/triangle_mesh.hpp"
#include "calibration/estimate/rotation_vector.hpp"
#include "calibration/object_pose/corners_file.hpp"
#include "calibration/stereo/joint_cameras.hpp"
#include "calibration/stereo/pair_agreement.hpp"
#include "core/atomic_file.hpp"
#include "core/input_error.hpp"
#include "core/lens_numbers.hpp"
#include "core/shown_text.hpp"
#include "rig/plan/operator_plan.hpp"
#include "session/recording/png_file.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

constexpr int kMarkerPictures = 3;  // of each posture; their mean is used

/// Every camera takes pictures. None testifies about the beam, which stays off: boards and marker move before them.
void take_pictures(RigConfig& rig, int pictures) {
  rig.scan.capture.dark_frames = pictures;
  for (RigCamera& camera : rig.cameras) {
    camera.record = RecordWhen::kAll;
    rig.scan.safety.beam.waived.push_back(camera.name);
  }
}

/// bMa * aMc with both their errors; a turn of a takes c along.
CalibratedPose composed(const CalibratedPose& bMa, const CalibratedPose& aMc) {
  const Eigen::Matrix3d bRa = bMa.pose.linear();
  const Vector3d lever = bRa * aMc.pose.translation();
  CalibratedPose bMc;
  bMc.pose = bMa.pose * aMc.pose;
  bMc.sigma_m = (bMa.sigma_m.cwiseAbs2() + bRa.cwiseAbs2() * aMc.sigma_m.cwiseAbs2() +
                 cross(lever).cwiseAbs2() * bMa.sigma_rad.cwiseAbs2())
                    .cwiseSqrt();
  bMc.sigma_rad = (bMa.sigma_rad.cwiseAbs2() + bRa.cwiseAbs2() * aMc.sigma_rad.cwiseAbs2()).cwiseSqrt();
  return bMc;
}

}  // namespace

GuidedCalibration::GuidedCalibration(const GuidedOptions& options, Progress& progress)
    : options_(options),
      progress_(progress),
      file_(options.folder / kCalibration),
      write_{options.folder / kUnfinishedCalibration, options.scan.rig, true},
      targets_(targets_of(load_drawn_rig(find_rig(options.scan.rig)))) {
  fs::create_directories(options.folder);
  fs::remove(write_.file);
}

OpenedSession GuidedCalibration::session(const std::string& name, const std::string& scene_board,
                                         const std::string& ask,
                                         const std::function<ReadyRig::PlanFrom(RigConfig&)>& prepare,
                                         const std::optional<PictureJudge>& judge) {
  RigConfig rig = CalibrationPart(write_).rig();
  ScanOptions scan = options_.scan;
  scan.command = "calibrate all";
  std::optional<LivePictures> live;
  if (judge) {
    live.emplace(*judge, progress_);
    scan.on_frame = [&live](const FrameRecord& record, const cv::Mat& image) { live->frame(record, image); };
  }
  if (!scene_board.empty()) scan.world.boards = {scene_board};
  const ReadyRig::PlanFrom plan = prepare(rig);
  const bool person = rig.scene.empty();
  return recorded_session(scan, rig, options_.folder / name, plan, progress_, [&](ScanOptions&) {
    if (person) confirm(ask + ". Ready?", options_.scan.yes);
  });
}

GuidedCalibration::SharedBoards GuidedCalibration::shared(const Seen& a, const Seen& b) {
  SharedBoards out;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (a[k] && b[k])
      (held_back(k) ? out.kept : out.used).push_back({a[k]->name + " and " + b[k]->name, a[k]->board, b[k]->board});
  return out;
}

std::vector<GuidedCalibration::Seen> GuidedCalibration::boards_that_count(
    const std::vector<const RigCamera*>& cameras) {
  const RigConfig rig = CalibrationPart(write_).rig();
  const BoardTarget target = targets_.board.target();
  BoardCount count(cameras);
  std::vector<Seen> seen(cameras.size());
  for (int n = 1;; ++n) {
    const std::string name = n == 1 ? "boards" : fmt::format("boards-{}", n);
    const std::size_t before = count.pictures();
    std::optional<OpenedSession> opened = session_so_far(options_.folder / name, rig, options_.scan.world, progress_);
    const bool fresh = !opened;
    if (fresh) {
      if (count.missing().empty()) return seen;
      opened = session(
          name, targets_.board.scene_board,
          (n == 1 ? "" : "So far " + count.missing() + ". ") +
              "Hold the board before every camera, near and far, in all parts of its image, tilted to all sides, still "
              "for a moment in each place",
          [&](RigConfig& taken) -> ReadyRig::PlanFrom {
            take_pictures(taken, 1);
            const double rest = std::max(0.0, targets_.board.interval - 2 * taken.scan.capture.frame_period);
            return [&taken, rest, pictures = static_cast<std::size_t>(targets_.board.pictures)](const JointVector& q) {
              return make_postures_plan(taken.scan, q, std::vector<JointVector>(pictures, q), rest);
            };
          },
          judge_boards(target, count, cameras.size()));
    } else {
      progress_.note("found " + printable((options_.folder / name).string()) + ", recorded already");
    }
    std::vector<std::vector<BoardShot>> shots;
    std::size_t moments = 0;
    for (const RigCamera* camera : cameras) {
      shots.push_back(board_shots(opened->session, camera->name, target, progress_));
      moments = std::max(moments, shots.back().size());
    }
    for (std::size_t k = 0; k < moments; ++k) {
      std::vector<BoardSearch> moment;
      for (const auto& of_camera : shots)
        moment.push_back(k < of_camera.size() ? of_camera[k].search : BoardShot().search);
      const std::vector<std::string> why_not = count.add(moment);
      for (std::size_t c = 0; c < cameras.size(); ++c)
        seen[c].push_back(moment[c].board && why_not[c].empty()
                              ? std::optional(BoardPicture{name + "/" + shots[c][k].file, *moment[c].board})
                              : std::nullopt);
    }
    if (!fresh) progress_.note("boards that count: " + count.so_far());
    // Nobody moves a simulated board otherwise than it was moved.
    if (fresh && !count.missing().empty() && (!rig.scene.empty() || count.pictures() == before))
      throw InputError(options_.folder, count.missing() + "; run the same command again to go on");
  }
}

void GuidedCalibration::boards() {
  progress_.note("step 1 of 5: lenses, and where the cameras stand to each other");
  CalibrationPart part(write_);
  const BoardTarget target = targets_.board.target();
  RigCamera left = part.camera(CameraRole::kLeft), mono = part.camera(CameraRole::kMono),
            right = part.camera(CameraRole::kRight);
  for (const RigCamera* camera : {&left, &mono, &right}) (void)in_air(*camera);  // before anybody holds up a board
  const std::vector<Seen> seen = boards_that_count({&left, &mono, &right});
  const Seen &in_left = seen[0], &in_mono = seen[1], &in_right = seen[2];
  const SharedBoards both_eyes = shared(in_left, in_right), left_and_mono = shared(in_left, in_mono);

  const IntrinsicsSolution lens = lens_of(mono, in_mono);
  progress_.update("the stereo pair", 0);
  const StereoSolution eyes = solve(StereoProblem{{left.model.width, left.model.height},
                                                  {right.model.width, right.model.height},
                                                  target,
                                                  both_eyes.used,
                                                  {},
                                                  {},
                                                  port_of(left),
                                                  in_air(left),
                                                  in_air(right)});
  for (const std::string& out : eyes.left_out) progress_.note("left out: " + printable(out));
  const fs::path report = options_.folder / "report";
  write_camera_pictures(report / mono.name, lens, lens.mean_distance());
  write_camera_pictures(report / left.name, eyes.left, eyes.left.mean_distance());
  write_camera_pictures(report / right.name, eyes.right, eyes.right.mean_distance());

  progress_.update("all cameras together", 0);
  BoardBundle start;
  start.target = target;
  start.lens = std::max(lens.lens, eyes.bundle.lens);
  start.lens_held = lens.bundle.lens_held && eyes.bundle.lens_held;
  start.bends = lens.bundle.bends || eyes.bundle.bends;
  start.cameras = {eyes.bundle.cameras[0], {lens.camera}, eyes.bundle.cameras[1]};
  start.kMc = {Transform::Identity(), agree_on_pose(start.cameras[0], lens.camera, target, left_and_mono.used).rMc,
               eyes.rMc};
  std::vector<fs::path> files;
  for (std::size_t k = 0; k < in_left.size(); ++k) {
    BoardView view{fmt::format("picture {}", k + 1), {}};
    for (const Seen& by_camera : seen) {
      if (by_camera[k]) files.push_back(options_.folder / by_camera[k]->name);
      view.seen.push_back(by_camera[k] ? by_camera[k]->board : FoundBoard());
    }
    if (!held_back(k)) start.views.push_back(std::move(view));
  }
  const JointCameras found = refine_together(std::move(start));
  for (const std::string& out : found.left_out) progress_.note("left out: " + out);
  boards_source_ = CalibrationPart::source("boards, all cameras together", options_.folder / "boards", files);
  left_in_mono_ = calibrated_pose(found.bundle.kMc[1], found.covariance[1]);
  part.values.stereo = {boards_source_, calibrated_inverse(found.bundle.kMc[2], found.covariance[2])};
  RigCamera* const cameras[] = {&left, &mono, &right};
  for (std::size_t k = 0; k < found.bundle.cameras.size(); ++k) {
    cameras[k]->model = found.bundle.cameras[k];
    std::vector<double> sigma(found.sigma[k].begin(), found.sigma[k].begin() + kLensNumbers.size());
    sigma.insert(sigma.end(), found.port_sigma[k].begin(), found.port_sigma[k].end());
    part.values.camera(cameras[k]->name).lens = {boards_source_, cameras[k]->model, std::move(sigma), found.rms,
                                                 static_cast<int>(found.bundle.views.size())};
  }
  left.bMc = mono.bMc * left_in_mono_.pose;
  right.bMc = left.bMc * found.bundle.kMc[2].inverse();
  std::vector<BoardPicture> kept;
  for (std::size_t k = 0; k < in_mono.size(); ++k)
    if (in_mono[k] && held_back(k)) kept.push_back(*in_mono[k]);
  checks_.push_back(lens_check(mono, target, kept));
  checks_.push_back(stereo_check(left, right, target, both_eyes.kept));
  checks_.push_back(mount_check(left, mono, target, left_and_mono.kept));
  joint_.problem.boards = seen_from(found.bundle, 1);
  joint_.problem.cameras = {mono.name, left.name, right.name};
  joint_.files = files;
  joint_.views = static_cast<int>(found.bundle.views.size());
  joint_.mono_boards = kept;
  joint_.both_eyes = both_eyes.kept;
  joint_.left_and_mono = left_and_mono.kept;
  for (const auto& [camera, alone] : {std::pair(&mono, &lens), {&left, &eyes.left}, {&right, &eyes.right}})
    if (alone->tried.back().port)
      progress_.note(camera->name + ": " + alone->decision.substr(alone->decision.rfind('\n') + 1));
  progress_.note(
      fmt::format("{} boards; {} in {:.0f} % of the image, lens model {}; {:.3f} px rms, all cameras together",
                  found.bundle.views.size(), mono.name, 100 * lens.coverage.share, name_of(lens.lens), found.rms));
  part.write();
}

std::optional<FlatPort> GuidedCalibration::port_of(const RigCamera& camera) const {
  const std::optional<FlatPort> tried = options_.port.tried();
  return tried ? tried : camera.model.port;
}

std::optional<CameraModel> GuidedCalibration::in_air(const RigCamera& camera) const {
  const fs::path& file = options_.port.in_air;
  if (file.empty()) return std::nullopt;
  const Calibration air = read_calibration(file);
  const CameraCalibration* const calibrated = air.camera(camera.name);
  if (!calibrated || !calibrated->lens) throw InputError(file, "found no lens of " + camera.name + ", expected one");
  return lens_in_air(calibrated->lens->model, camera.model.width, camera.model.height, file);
}

IntrinsicsSolution GuidedCalibration::lens_of(const RigCamera& camera, const Seen& seen) const {
  progress_.update("the lens of " + camera.name, 0);
  IntrinsicsProblem problem;
  problem.width = camera.model.width, problem.height = camera.model.height;
  problem.target = targets_.board.target();
  problem.port = port_of(camera);
  problem.in_air = in_air(camera);
  for (std::size_t k = 0; k < seen.size(); ++k)
    if (seen[k] && !held_back(k)) problem.pictures.push_back(*seen[k]);
  return solve(problem);
}

void GuidedCalibration::marker() {
  progress_.note("step 2 of 5: where the cameras stand to the arm");
  const OpenedSession opened = session(
      "marker", targets_.gripper.scene_board, "Put the marker into the gripper and stand back",
      [&](RigConfig& rig) -> ReadyRig::PlanFrom {
        take_pictures(rig, kMarkerPictures);
        return [&](const JointVector& q) {
          return make_postures_plan(rig.scan, q, marker_postures(rig, targets_.gripper, q, progress_), 0);
        };
      },
      judge_marker(targets_.gripper.marker, CalibrationPart(write_).camera(CameraRole::kMono).name));
  CalibrationPart part(write_);
  const RigCamera &camera = part.camera(CameraRole::kMono), &left = part.camera(CameraRole::kLeft),
                  &right = part.camera(CameraRole::kRight);
  HandEyeProblem problem;
  problem.camera = camera.model;
  problem.arm = part.rig().arm;
  problem.target_c = camera.bMc.inverse() * part.rig().object.bMo.translation();
  problem.refine_links = false;
  std::vector<HandEyeView> kept;
  std::vector<MarkerPosture> postures;
  std::vector<fs::path> files{opened.session.path / "joints.csv", opened.session.path / "frames.csv"};
  for (MarkerPosture& posture :
       seen_postures(opened.session, {&camera, &left, &right}, targets_.gripper.marker, progress_)) {
    auto view = hand_eye_view(posture, camera.model);
    if (!view) continue;
    files.push_back(opened.session.path / view->name);
    const bool keep = held_back(files.size());
    (keep ? kept : problem.views).push_back(*std::move(view));
    if (!keep) postures.push_back(std::move(posture));
  }
  progress_.update("camera and arm", 0);
  const HandEyeSolution found = solve(problem);
  put(part, CalibrationPart::source("marker in the gripper", opened.session.path, files), camera, problem.arm, found);
  RigCamera placed = camera;
  placed.bMc = found.cMb.inverse();
  checks_.push_back(marker_check(placed, found.arm, found.eMg, kept));
  joint_.problem.cMb = found.cMb, joint_.problem.eMg = found.eMg, joint_.problem.arm = found.arm;
  for (std::size_t i = 0; i < joint_.problem.refined_zeros.size(); ++i)
    joint_.problem.refined_zeros[i] = found.arm.dh[i].theta0 != problem.arm.dh[i].theta0;
  for (std::size_t i = 0; i < postures.size(); ++i)
    if (std::find(found.outliers.begin(), found.outliers.end(), i) == found.outliers.end())
      joint_.problem.postures.push_back(std::move(postures[i]));
  joint_.files.insert(joint_.files.end(), files.begin(), files.end());
  joint_.marker = kept;
  part.values.camera(left.name).mount = {boards_source_,
                                         composed(*part.values.camera(camera.name).mount, left_in_mono_)};
  part.write();
  for (const std::size_t i : found.outliers) progress_.note("left out: " + problem.views[i].name);
  progress_.note(fmt::format("{}: {} postures, {:.3f} px rms (corners {:.3f} px, joints {:.2f} mrad)", camera.name,
                             problem.views.size(), found.rms, found.corner_sigma, 1e3 * found.joint_sigma));
  progress_.note("arm: " + found.decision);
}

void GuidedCalibration::sweep() {
  progress_.note("step 3 of 5: the camera's delay");
  const std::vector<OpenedSession> sessions{
      session("sweep", "", "Put the object where it is to be measured, and nothing else", [&](RigConfig& rig) {
        for (RigCamera& camera : rig.cameras) {
          if (camera.record != RecordWhen::kDark) continue;
          camera.record = RecordWhen::kAll;  // they testify about the beam in no scan
          rig.scan.safety.beam.waived.push_back(camera.name);
        }
        return there_and_back(rig);
      })};
  CalibrationPart part(write_);
  const Session& recorded = sessions.front().session;
  const CalibratedCamera& camera = recorded.camera(CameraRole::kMono);
  const TimeOffsetSolution found = solve(time_problem(sessions, progress_));
  const Duration offset = camera.time_offset + from_seconds(found.offset);
  part.values.camera(camera.name).time = {
      CalibrationPart::source("there and back", recorded.path, recorded_files(sessions)), offset,
      from_seconds(found.sigma)};
  joint_.problem.delay = SweepDelay{0, found.half_width};  // the sheets are recorded with what was found
  part.write();
  progress_.note(
      fmt::format("{}: stamps are {:.3f} +- {:.3f} ms late", camera.name, 1e3 * seconds(offset), 1e3 * found.sigma));
}

void GuidedCalibration::sheet() {
  progress_.note("step 4 of 5: the laser's sheet");
  std::vector<OpenedSession> sessions;
  for (std::size_t place = 0; place < SheetTarget::kPlaces; ++place)
    sessions.push_back(session(
        place == 0 ? "sheet-before" : "sheet-behind",
        targets_.sheet.scene_boards.empty() ? "" : targets_.sheet.scene_boards[place],
        place == 0 ? "Lean the checkerboard over the object, on the arm's side of it"
                   : "Lean the checkerboard behind the object, as far as the laser reaches",
        [&](RigConfig& rig) { return there_and_back(rig); },
        judge_sheet(CalibrationPart(write_).camera(CameraRole::kMono), targets_.sheet)));
  CalibrationPart part(write_);
  const RigConfig& rig = part.rig();
  const RigCamera& camera = part.camera(CameraRole::kMono);
  std::vector<SheetViews> there, back;
  std::vector<SheetView> used;
  for (const OpenedSession& opened : sessions) {
    there.push_back(sheet_views(opened, camera, targets_.sheet, progress_));
    back.push_back(there.back());
    std::erase_if(there.back().views, [](const SheetView& view) { return view.pass != 0; });
    std::erase_if(back.back().views, [](const SheetView& view) { return view.pass == 0; });
    used.insert(used.end(), there.back().views.begin(), there.back().views.end());
  }
  progress_.update("the laser's plane", 0);
  const LaserPlaneSolution found = solve(sheet_problem(used, rig, camera));
  checks_.push_back(sheet_check(camera, rig.arm, found.plane, back));
  for (const SheetViews& place : there) {
    SheetBoard board{fmt::format("board {} under the stripe", joint_.problem.sheets.size() + 1),
                     place.board.points,
                     place.board.corners,
                     place.board.cMt,
                     {}};
    for (const SheetView& view : place.views)
      if (const auto stripe = board_stripe(camera.model, board.cMt, view.points, view.q, view.velocity))
        board.stripes.push_back(*stripe);
    joint_.problem.sheets.push_back(std::move(board));
  }
  joint_.problem.ePl = found.plane;
  joint_.ways_back = std::move(back);
  const std::vector<fs::path> files = recorded_files(sessions);
  joint_.files.insert(joint_.files.end(), files.begin(), files.end());
  write_file_durably(options_.folder / "report" / "sheet.svg", sheet_chart(rig, camera, found.plane, there));
  part.values.laser = {CalibrationPart::source("stripe on checkerboards", options_.folder, recorded_files(sessions)),
                       found.plane, found.sigma_rad, found.sigma_m, found.rms};
  part.write();
  progress_.note(fmt::format(
      "sheet: {} frames, {:.3f} mm rms, direction +- {:.2f} mrad; over the elbow's angle it moves by "
      "{:.2f} +- {:.2f} mm/rad, 0 if the arm's links are right",
      used.size(), 1e3 * found.rms, 1e3 * found.sigma_rad, 1e3 * found.slope.value_or(0), 1e3 * found.slope_sigma));
  compare_with_stereo(rig, camera.time_offset, found);
}

void GuidedCalibration::joint() {
  progress_.update("all steps together", 0);
  CalibrationPart part(write_);
  joint_outcome_ = refine_jointly(joint_, checks_, options_.folder, part);
  checks_ = joint_outcome_.checks;
  if (joint_outcome_.taken) part.write();
  progress_.note("all steps together: " + joint_outcome_.why);
}

/// The paper's way. It says little where the stripe runs along the eyes' baseline, and is not used.
void GuidedCalibration::compare_with_stereo(const RigConfig& rig, Duration time_offset,
                                            const LaserPlaneSolution& by_boards) {
  const RigCamera &left = *rig.find_camera(CameraRole::kLeft), &right = *rig.find_camera(CameraRole::kRight);
  const OpenedSession sweep = open_session(options_.folder / "sweep");
  const Duration late = time_offset - sweep.session.camera(CameraRole::kMono).time_offset;
  try {
    const LaserPlaneSolution stereo =
        solve(sheet_problem(stereo_views(sweep, left, right, late, progress_), rig, left));
    const PlaneDifference apart = difference(by_boards, stereo);
    progress_.note(
        fmt::format("  by stereo: {} frames, {:.2f} mm rms, direction +- {:.1f} mrad; {:.1f} mrad and {:.2f} mm "
                    "from the boards', {:.1f} sigmas",
                    stereo.groups.size(), 1e3 * stereo.rms, 1e3 * stereo.sigma_rad, 1e3 * apart.angle,
                    1e3 * apart.distance, apart.sigmas));
  } catch (const InputError& e) {
    progress_.note(std::string("  by stereo: ") + e.what());
  }
}

bool GuidedCalibration::object() {
  progress_.note("step 5 of 5: where the object stands");
  const Session recorded = Session::open(options_.folder / "sweep");
  CalibrationPart part(write_);
  const RigConfig& rig = part.rig();
  const RigCamera& camera = part.camera(CameraRole::kMono);
  const cv::Mat picture = dark_picture(recorded, camera.name);
  const fs::path image = options_.folder / "object.png", corners = options_.folder / "corners.yaml";
  if (!fs::exists(image)) write_file_durably(image, png_of(picture, image));
  const TriangleMesh mesh = read_mesh(rig.object.mesh);
  ObjectPoseProblem problem{camera.model, {}, {mesh.vertices, mesh.triangles}};
  if (!fs::exists(corners)) {
    if (rig.scene.empty()) {
      progress_.warn("look up the object's corners in " + printable(image.string()) + " and write them into " +
                     printable(corners.string()) +
                     " (docs/reference/formats.md), or click them in the console (tankrig serve) if this folder is in "
                     "sessions/; then run the same command again");
      return false;
    }
    click_corners(load_world(rig, options_.scan.world), camera.name, problem.shape, options_.click_sigma,
                  options_.scan.world.seed, corners);
  }
  problem.corners = clicked_corners(read_corners(corners), problem.shape);
  const SnappedPose found = solve_with_snapping(grey_of(picture), problem);
  bMo_clicked_ = camera.bMc * found.raw.cMo;
  put(part, CalibrationPart::source("clicked corners", options_.folder, {corners, image, rig.object.mesh}), camera,
      found.snapped);
  part.write();
  const fs::path drawing = options_.folder / "report" / "object.png";
  write_file_durably(drawing, png_of(object_picture(picture, problem, found), drawing));
  progress_.note(fmt::format("object: clicks err by {:.2f} px, snapped {:.2f} px; its surface is known to {:.3f} mm",
                             found.raw.rms_px, found.snapped.rms_px, 1e3 * found.snapped.surface.rms));
  return true;
}

Calibration GuidedCalibration::judge() {
  CalibrationPart part(write_);
  part.write(checks_);
  fs::rename(write_.file, file_);
  return part.values;
}

}  // namespace tankrig::app
