// A whole rig whose truth is known, and everything that a calibration records of it: boards, marker, stripes, with their errors.
#pragma once

#include <random>

#include "calibration/budget/error_budget.hpp"
#include "calibration/hand_eye/hand_eye.hpp"
#include "calibration/joint/joint.hpp"
#include "calibration/laser_plane/laser_plane.hpp"
#include "calibration/stereo/joint_cameras.hpp"
#include "core/angles.hpp"
#include "tests/hand_eye/generated_postures.hpp"

namespace tankrig::testing_support {

enum Eye : std::size_t { kLeft, kMono, kRight };  // in the order of the steps
inline const std::vector<std::string> kEyes{"left", "mono", "right"};

/// What a calibration believes of the rig.
struct BelievedRig {
  std::vector<CameraModel> lenses;  ///< by Eye
  std::vector<Transform> bMk;
  ArmModel arm;
  Plane ePl;
};

struct GeneratedRig {
  unsigned seed = 1;
  int boards = 14;
  std::size_t postures = 20;
  double board_px = 0.12, marker_px = 0.2, joint_rad = 0.4e-3;
  double point_px = 0.15, speckle_px = 0.1;  ///< of a stripe's point; shared by points near each other
  double jitter_rad = 0.1e-3;                ///< of the elbow in motion; neighbouring frames share it
  double shoulder_zero = 0.008, elbow_zero = -0.012;
  double delay = 0;              ///< of the mono camera's stamps, beyond what they were corrected by [s]
  bool back = false;             ///< the sweep over the boards goes back, too
  double delay_sigma = 0.05e-3;  ///< of the sweep over the object, which tells the delay [s]
  Transform left_knock = Transform::Identity();  ///< of the left eye in itself, after the boards
  Transform mono_knock = Transform::Identity();  ///< of the mono camera, after the marker

  BoardTarget target = board_target(TargetKind::kCheckerboard, "9x6", 0.03);
  BoardTarget sheet = board_target(TargetKind::kCheckerboard, "9x6", 0.03);
  Plane ePl{Vector3d(0.9995, 0.02, -0.024).normalized(), 0.0979};
  Transform eMg = make_transform_rpy({0.03, 0.01, -0.06}, {0.1, from_degrees(70), 0.2});
  std::vector<CameraModel> lenses{{640, 480, 765.4, 762.9, 315.7, 236.8, -0.28, 0.12, 0.0006, -0.0004, 0},
                                  {720, 576, 626.08, 682.78, 368.93, 284.83, -0.370, 0.174, -0.0016, 0.0029, 0},
                                  {640, 480, 758.1, 759.3, 322.4, 241.2, -0.27, 0.11, -0.0003, 0.0005, 0}};
  std::vector<Transform> bMk{
      make_transform({0.575, 0.215, 0.57}, {0.397810856, -0.280376899, -0.584590789, 0.649144766}),
      make_transform({0.716, 0.228, 0.585}, {0.418637960, -0.308630971, -0.569861946, 0.636196939}),
      make_transform({0.589017063, 0.128580300, 0.561102960}, {0.397810856, -0.280376899, -0.584590789, 0.649144766})};

  /// Windows of 10 mm acrylic before all lenses, in water; the lenses are known from air.
  void put_behind_ports() {
    for (std::size_t k = 0; k < lenses.size(); ++k) {
      const double leans = 0.01 * static_cast<double>(k);
      lenses[k].port = FlatPort{0.028 + 0.3 * leans, 0.01, Vector3d(0.012 - leans, 0.5 * leans, 1).normalized()};
    }
  }

  // What generate() draws.
  JointVector sweep_off = JointVector::Zero();  ///< by how much joints stand beyond what they read, all along the sweep
  BoardBundle bundle;                           ///< with a guess of cameras and places
  std::vector<MarkerPosture> seen_postures;     ///< by Eye
  struct SheetStripe {
    JointVector q, velocity;
    StripeLine line;
  };
  struct Sheet {
    FoundBoard corners;
    std::vector<SheetStripe> stripes;
  };
  std::vector<Sheet> sheets;
  SweepDelay swept;

  ArmModel true_arm() const { return arm5e_off_by(shoulder_zero, elbow_zero); }
  BudgetSweep sweep() const {
    BudgetSweep out;
    out.posture << 0, 0.13, 1.3, 0, 0.1;
    out.from = 1.1, out.to = 2.1, out.velocity = 0.1;
    return out;
  }

  void generate() {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, 1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    generate_boards(random, normal, uniform);
    generate_marker(random, normal, uniform);
    for (int joint = 0; joint < 4; ++joint) sweep_off[joint] = joint_rad * normal(random);
    generate_sheet({-0.17, 0.03, 0.97}, {0.62, 0.08, -0.78}, random, normal);
    generate_sheet({-0.40, 0.02, 0.98}, {0.75, 0.02, -0.66}, random, normal);
    swept = {delay + delay_sigma * normal(random), 1.96 * delay_sigma};
  }

  /// Places off the box's faces, root mean square: with the object where the mono camera sees it, and in the arm's base [m].
  struct Misplacements {
    double laser = 0, stereo = 0, laser_in_base = 0;
  };
  Misplacements judge(const BelievedRig& believed) const {
    const auto measuring = [](const BelievedRig& of) {
      return MeasuringRig{{"mono", of.lenses[kMono], of.bMk[kMono]},
                          BudgetCamera{"left", of.lenses[kLeft], of.bMk[kLeft]},
                          BudgetCamera{"right", of.lenses[kRight], of.bMk[kRight]},
                          of.arm,
                          of.ePl};
    };
    ArmModel arm = true_arm();
    for (std::size_t joint = 0; joint < 4; ++joint) arm.dh[joint].theta0 += sweep_off[static_cast<Eigen::Index>(joint)];
    const MeasuringRig truth = measuring({lenses, bMk, arm, ePl}), found = measuring(believed);
    const auto targets = box();
    const Misplacement by_mono =
        misplacement(truth, found, bMk[kMono] * believed.bMk[kMono].inverse(), sweep(), targets);
    return {by_mono.laser.rms, by_mono.stereo.rms,
            misplacement(truth, found, Transform::Identity(), sweep(), targets).laser.rms};
  }

 private:
  /// Faces that the cameras see of a box between the boards.
  static std::vector<BudgetTarget> box() {
    std::vector<BudgetTarget> all;
    const Vector3d middle(-0.27, 0.025, 1.02);
    for (double a = -0.1; a <= 0.1; a += 0.04)
      for (double b = -0.1; b <= 0.1; b += 0.04) {
        all.push_back({middle + Vector3d(0.7 * a, b, 0), -Vector3d::UnitZ()});
        all.push_back({middle + Vector3d(0.07, b, 0.05 + 0.4 * a), Vector3d::UnitX()});
      }
    return all;
  }

  std::optional<FoundBoard> whole(std::size_t k, const std::vector<Vector3d>& points, const Transform& kMt,
                                  double noise, std::mt19937_64& random,
                                  std::normal_distribution<double>& normal) const {
    if (kMt.linear().col(2).dot((kMt * (points.back() / 2)).normalized()) < 0.3) return std::nullopt;
    FoundBoard board;
    for (const Vector3d& p : points) {
      const auto pixel = lenses[k].project(kMt * p);
      if (!pixel || !lenses[k].contains(*pixel)) return std::nullopt;
      board.ids.push_back(static_cast<int>(board.ids.size()));
      board.pixels.push_back(*pixel + noise * Vector2d(normal(random), normal(random)));
    }
    board.smallest_spacing = 15;
    return board;
  }

  void generate_boards(std::mt19937_64& random, std::normal_distribution<double>& normal,
                       std::uniform_real_distribution<double>& uniform) {
    bundle.target = target;
    bundle.lens = LensModel::kK1K2P1P2;
    for (std::size_t k = 0; k < lenses.size(); ++k) {
      RationalCamera guess{lenses[k]};
      if (guess.port)
        guess.port = FlatPort{0.03, 0.01}, bundle.lens_held = true;
      else
        guess.fx *= 1.01, guess.fy *= 0.995, guess.cx += 4, guess.k1 *= 0.8, guess.k2 = 0;
      bundle.cameras.push_back(guess);
      bundle.kMc.push_back(k == kLeft ? Transform::Identity()
                                      : make_transform_rpy({0.005, -0.004, 0.006}, {0.008, 0.004, -0.006}) *
                                            bMk[k].inverse() * bMk[kLeft]);
    }
    while (static_cast<int>(bundle.views.size()) < boards) {
      const double distance = 0.8 + 0.25 * uniform(random);
      const Vector3d place(0.45 * distance * uniform(random), 0.36 * distance * uniform(random), distance);
      const Transform mMmiddle =
          make_transform_rpy(place, {0.7 * uniform(random), 0.7 * uniform(random), 0.5 * uniform(random)});
      const Transform bMt = bMk[kMono] * mMmiddle * Eigen::Translation3d(-target.points().back() / 2);
      BoardView view{"picture " + std::to_string(bundle.views.size() + 1), {}};
      int seen = 0;
      for (std::size_t k = 0; k < lenses.size(); ++k) {
        const auto board = whole(k, target.points(), bMk[k].inverse() * bMt, board_px, random, normal);
        seen += board ? 1 : 0;
        view.seen.push_back(board.value_or(FoundBoard()));
      }
      if (seen >= 2) bundle.views.push_back(std::move(view));
    }
  }

  void generate_marker(std::mt19937_64& random, std::normal_distribution<double>& normal,
                       std::uniform_real_distribution<double>& uniform) {
    const double h = 0.03;
    const std::vector<Vector3d> marker = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
    const ArmModel arm = true_arm();
    while (seen_postures.size() < postures) {
      MarkerPosture posture;
      posture.name = "posture " + std::to_string(seen_postures.size() + 1);
      posture.q << 0.45 * uniform(random), 0.4 + 0.3 * uniform(random), 1.4 + 0.7 * uniform(random),
          3.1 * uniform(random), 0;
      JointVector stands = posture.q;
      for (int joint = 0; joint < 4; ++joint) stands[joint] += joint_rad * normal(random);
      for (std::size_t k = 0; k < lenses.size(); ++k) {
        const Transform bMseen = k == kLeft ? Transform(bMk[k] * left_knock) : bMk[k];
        const Transform kMg = bMseen.inverse() * arm.bMe(stands) * eMg;
        SeenMarker seen;
        for (const Vector3d& p : marker) {
          const auto pixel = lenses[k].project(kMg * p);
          if (!pixel || !lenses[k].contains(*pixel) || kMg.linear().col(2).dot(-kMg.translation().normalized()) < 0.4)
            break;
          seen.points.push_back(p);
          seen.corners.push_back(*pixel + marker_px * Vector2d(normal(random), normal(random)));
        }
        posture.seen.push_back(seen.points.size() == marker.size() ? seen : SeenMarker());
      }
      if (!posture.seen[kMono].points.empty()) seen_postures.push_back(std::move(posture));
    }
  }

  void generate_sheet(const Vector3d& middle, const Vector3d& facing, std::mt19937_64& random,
                      std::normal_distribution<double>& normal) {
    const Transform mMb = (bMk[kMono] * mono_knock).inverse();
    const CameraModel& lens = lenses[kMono];
    Transform bMt = Transform::Identity();
    const Vector3d z = -facing.normalized(), x = (Vector3d::UnitY() - z.y() * z).normalized();
    bMt.linear() << x, z.cross(x), z;
    bMt.translation() = middle - bMt.linear() * sheet.points().back() / 2;
    Sheet out;
    out.corners = whole(kMono, sheet.points(), mMb * bMt, board_px, random, normal).value();
    const Vector2d more = Vector2d::Constant(0.9 * sheet.spacing), most = sheet.points().back().head<2>() + more;
    const ArmModel arm = true_arm();
    double jitter = 0;
    std::vector<std::pair<double, double>> frames;  // elbow, its velocity
    for (double elbow = sweep().from; elbow < sweep().to; elbow += 0.006) frames.emplace_back(elbow, sweep().velocity);
    for (std::size_t i = back ? frames.size() : 0; i > 0; --i)
      frames.emplace_back(frames[i - 1].first, -sweep().velocity);
    for (const auto& [elbow, speed] : frames) {
      JointVector q = sweep().posture, velocity = JointVector::Zero();
      q[kElbow] = elbow, velocity[kElbow] = speed;
      jitter = 0.8 * jitter + 0.6 * jitter_rad * normal(random);
      JointVector stands = q + sweep_off - delay * velocity;
      stands[kElbow] += jitter;
      const Plane tPl = (arm.bMe(stands).inverse() * bMt).inverse() * ePl;
      // Over the board's columns of points, where the sheet is.
      std::vector<Vector2d> pixels;
      for (double along = -more.x(); along < most.x(); along += 0.001) {
        const double row = -(tPl.normal.x() * along + tPl.offset) / tPl.normal.y();
        if (row < -more.y() || row > most.y()) continue;
        if (const auto pixel = lens.project(mMb * bMt * Vector3d(along, row, 0))) pixels.push_back(*pixel);
      }
      if (pixels.size() < 100) continue;
      StripeLine line;
      const Vector2d way = pixels.back() - pixels.front();
      line.rows = std::abs(way.y()) > std::abs(way.x());
      const int a = line.rows ? 1 : 0, b = 1 - a;
      if (way[a] < 0) std::reverse(pixels.begin(), pixels.end());
      double speckle = 0;
      std::size_t i = 0;
      for (int at = static_cast<int>(std::ceil(pixels.front()[a])); at < pixels.back()[a]; ++at) {
        while (pixels[i + 1][a] < at) ++i;
        const double share = (at - pixels[i][a]) / (pixels[i + 1][a] - pixels[i][a]);
        speckle = 0.87 * speckle + 0.493 * speckle_px * normal(random);
        line.points.push_back(
            {at, pixels[i][b] + share * (pixels[i + 1][b] - pixels[i][b]) + speckle + point_px * normal(random),
             std::hypot(point_px, speckle_px)});
      }
      out.stripes.push_back({q, velocity, std::move(line)});
    }
    sheets.push_back(std::move(out));
  }
};

/// What the steps make of it, one after another, and what all of them together start from.
struct SteppedCalibration {
  BelievedRig believed;
  JointProblem problem;
};

inline SteppedCalibration by_steps(const GeneratedRig& rig) {
  SteppedCalibration out;
  const JointCameras cameras = refine_together(rig.bundle);
  const CameraModel mono = cameras.bundle.cameras[kMono];
  HandEyeProblem marker;
  marker.camera = mono;
  marker.arm = arm5e();
  marker.target_c = {0, 0, 1.1};
  marker.refine_links = false;
  for (const MarkerPosture& posture : rig.seen_postures) {
    const auto pose = planar_pose(mono, posture.seen[kMono]);
    marker.views.push_back({posture.name, posture.seen[kMono].points, posture.seen[kMono].corners, pose->cMg,
                            pose->flipped, posture.q, Transform::Identity()});
  }
  const HandEyeSolution arm = solve(marker);

  JointProblem& joint = out.problem;
  joint.boards = seen_from(cameras.bundle, kMono);
  joint.cameras = {"mono", "left", "right"};
  joint.cMb = arm.cMb, joint.eMg = arm.eMg, joint.arm = arm.arm;
  joint.refined_zeros = {false, true, true, false};
  for (MarkerPosture posture : rig.seen_postures) {
    std::swap(posture.seen[kLeft], posture.seen[kMono]);
    joint.postures.push_back(std::move(posture));
  }
  LaserPlaneProblem plane;
  for (const GeneratedRig::Sheet& sheet : rig.sheets) {
    SheetBoard board;
    board.name = "board " + std::to_string(joint.sheets.size() + 1);
    board.points = rig.sheet.points();
    board.corners = sheet.corners.pixels;
    board.cMt = board_pose({mono}, board.points, sheet.corners)->cMt;
    const Vector2d more = Vector2d::Constant(0.9 * rig.sheet.spacing);
    for (const auto& [q, velocity, line] : sheet.stripes) {
      const auto points = points_on_board(mono, line, board.cMt, {-more, rig.sheet.points().back().head<2>() + more});
      if (points.size() < 30) continue;
      const int group = static_cast<int>(plane.groups.size());
      plane.groups.push_back({"frame " + std::to_string(group), q[kElbow]});
      const Transform eMc = (arm.cMb * arm.arm.bMe(q)).inverse();
      for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, points.size() / 60))
        plane.points.push_back({eMc * points[i].p, std::max(points[i].sigma, 1e-5), group});
      if (const auto stripe = board_stripe(mono, board.cMt, points, q, velocity)) board.stripes.push_back(*stripe);
    }
    joint.sheets.push_back(std::move(board));
  }
  joint.ePl = solve(plane).plane;
  joint.delay = rig.swept;

  BelievedRig& believed = out.believed;
  for (const RationalCamera& camera : cameras.bundle.cameras) believed.lenses.push_back(camera);
  const Transform bMm = arm.cMb.inverse();
  for (const Transform& kMleft : cameras.bundle.kMc)
    believed.bMk.push_back(bMm * cameras.bundle.kMc[kMono] * kMleft.inverse());
  believed.arm = arm.arm, believed.ePl = joint.ePl;
  return out;
}

inline BelievedRig believed(const JointSolution& s) {
  BelievedRig out{
      {s.boards.cameras[1], s.boards.cameras[0], s.boards.cameras[2]}, {s.bMk[1], s.bMk[0], s.bMk[2]}, s.arm, s.ePl};
  return out;
}

}  // namespace tankrig::testing_support
