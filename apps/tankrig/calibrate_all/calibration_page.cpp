#include "apps/tankrig/calibrate_all/calibration_page.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <mstch/mstch.hpp>

#include "apps/tankrig/calibrate/measuring_rig.hpp"
#include "bench/report/picture_uri.hpp"
#include "bench/sweep/chart.hpp"
#include "core/angles.hpp"
#include "core/atomic_file.hpp"
#include "core/text_files.hpp"

namespace fs = std::filesystem;

namespace tankrig {
extern const char* const kCalibrationTemplate;  ///< calibration.html.mustache, compiled in
}

namespace tankrig::app {
namespace {

using mstch::array;
using mstch::map;
using Row = std::vector<std::string>;

mstch::node table(const char* heading, const std::string& note, const Row& columns, const std::vector<Row>& rows) {
  array nodes;
  for (const Row& row : rows) nodes.push_back(map{{"cells", array(row.begin(), row.end())}});
  return map{{"heading", std::string(heading)},
             {"note", note},
             {"columns", array(columns.begin(), columns.end())},
             {"rows", nodes}};
}

std::string origin(const CalibrationSource& source) { return source.method + ", " + source.made_utc; }

std::string difference(const Transform& found, const Transform& drawn) {
  const Transform between = drawn.inverse() * found;
  return fmt::format("{:.1f} mm and {:.2f}° from the rig file's", 1e3 * between.translation().norm(),
                     to_degrees(Eigen::AngleAxisd(between.rotation()).angle()));
}

std::string known_to(const CalibratedPose& pose) {
  return fmt::format("± {:.2f} mm, ± {:.2f} mrad", 1e3 * pose.sigma_m.maxCoeff(), 1e3 * pose.sigma_rad.maxCoeff());
}

Row pose_row(const std::string& what, const CalibratedMount& mount, const Transform& drawn) {
  return {what, difference(mount.pose, drawn), known_to(mount), origin(mount)};
}

Row lens_row(const std::string& camera, const CalibratedLens& lens, const CameraModel& drawn) {
  return {
      "lens of " + camera,
      fmt::format("f {:.2f}, {:.2f} px, centre {:.2f}, {:.2f} px; the rig file has {:.2f}, {:.2f} and {:.2f}, {:.2f}",
                  lens.model.fx, lens.model.fy, lens.model.cx, lens.model.cy, drawn.fx, drawn.fy, drawn.cx, drawn.cy),
      fmt::format("f ± {:.2f} px, centre ± {:.2f} px; {} boards, {:.3f} px rms", lens.sigma[0], lens.sigma[2],
                  lens.views, lens.rms_px),
      origin(lens)};
}

/// Part by part.
std::vector<Row> found_rows(const Calibration& c, const RigConfig& drawn) {
  std::vector<Row> rows;
  for (const CameraCalibration& camera : c.cameras) {
    const RigCamera& before = *std::find_if(drawn.cameras.begin(), drawn.cameras.end(),
                                            [&](const RigCamera& drawing) { return drawing.name == camera.name; });
    if (camera.lens) rows.push_back(lens_row(camera.name, *camera.lens, before.model));
    if (camera.mount) rows.push_back(pose_row(camera.name + " in the arm's base", *camera.mount, before.bMc));
    if (camera.time)
      rows.push_back({camera.name + "'s delay", fmt::format("{:.3f} ms", 1e3 * seconds(camera.time->offset)),
                      fmt::format("± {:.3f} ms", 1e3 * seconds(camera.time->sigma)), origin(*camera.time)});
  }
  if (c.stereo)
    rows.push_back(
        pose_row("right eye in the left one", *c.stereo,
                 drawn.find_camera(CameraRole::kLeft)->bMc.inverse() * drawn.find_camera(CameraRole::kRight)->bMc));
  if (c.joints) {
    std::string found, known;
    for (std::size_t j = 0; j < c.joints->theta0.size(); ++j) {
      const char* comma = j == 0 ? "" : ", ";
      found += fmt::format("{}{:.3f}°", comma, to_degrees(c.joints->theta0[j] - drawn.arm.dh[j].theta0));
      known += fmt::format("{}± {:.3f}°", comma, to_degrees(c.joints->sigma[j]));
    }
    rows.push_back({"zeros of slew, shoulder, elbow, jaw rotation", found, known, origin(*c.joints)});
  }
  if (c.laser) {
    const Plane &found = c.laser->ePl, &before = drawn.laser.ePl;
    rows.push_back({"laser's plane in the end effector",
                    fmt::format("{:.2f}° from the rig file's",
                                to_degrees(std::acos(std::min(1.0, std::abs(found.normal.dot(before.normal)))))),
                    fmt::format("± {:.2f} mrad, ± {:.3f} mm; {:.3f} mm rms", 1e3 * c.laser->sigma_rad,
                                1e3 * c.laser->sigma_m, 1e3 * c.laser->rms_m),
                    origin(*c.laser)});
  }
  if (c.object) rows.push_back(pose_row("object in the arm's base", *c.object, drawn.object.bMo));
  return rows;
}

std::vector<Row> budget_rows(const Budget& budget) {
  const auto cell = [](const std::optional<double>& m) {
    return m ? fmt::format("{:.3f}", 1e3 * *m) : std::string("-");
  };
  std::vector<Row> rows;
  for (const BudgetLine& line : budget.lines)
    rows.push_back({line.name, line.sigma + (line.measured ? "" : ", assumed"), cell(line.laser), cell(line.stereo)});
  rows.push_back({"all together", "", cell(budget.laser), cell(budget.stereo)});
  return rows;
}

std::vector<Row> joint_rows(const JointOutcome& joint) {
  std::vector<Row> rows;
  if (!joint.solution) return rows;
  for (const ErrorGroup& group : joint.solution->groups) {
    const bool angle = group.unit == "rad";
    rows.push_back({group.name, std::to_string(group.measurements),
                    fmt::format("{:.3f} {}", (angle ? 1e3 : 1) * group.sigma, angle ? "mrad" : group.unit),
                    group.allowance > 1 ? fmt::format("neighbours err alike: times {:.2f}", group.allowance) : ""});
  }
  for (const Estimate& e : joint.solution->parameters)
    if (e.unit == "s")
      rows.push_back({e.name, "", fmt::format("{:.3f} ms", 1e3 * e.sigma),
                      fmt::format("{:+.3f} ms from what the sweep told", 1e3 * e.value)});
  for (const Discrepancy& d : joint.solution->discrepancies) {
    rows.push_back({d.name, "", fmt::format("{:.1f} sigmas", d.sigmas),
                    fmt::format("{}limit {} sigmas", d.size ? size_in_words(*d.size) + "; " : "", kMostSigmas)});
  }
  return rows;
}

std::vector<Row> truth_rows(const TruthComparison& truth) {
  const auto row = [](const char* where, const Misplacement& m) {
    return Row{where, fmt::format("{:.3f}", 1e3 * m.laser.rms), fmt::format("{:.3f}", 1e3 * m.stereo.rms)};
  };
  return {row("object where it truly stands", truth.on_true_object),
          row("object where it was calibrated", truth.calibrated.places),
          row("object where it was clicked, before snapping", truth.clicked.places)};
}

array pictures(const fs::path& report, const std::vector<RigCamera>& cameras) {
  std::vector<std::pair<fs::path, std::string>> shown{
      {"object.png", "The object's corners as clicked and as snapped, its edges as calibrated"}};
  for (const RigCamera& camera : cameras) {
    const fs::path folder = camera.name;
    shown.emplace_back(folder / "coverage.png", camera.name + ": corners of all boards together");
    shown.emplace_back(folder / "residuals.png", camera.name + ": by how much each corner is missed, enlarged");
    shown.emplace_back(folder / "uncertainty.png",
                       camera.name + ": how well it is known where a pixel looks, at the boards' mean distance");
  }
  array nodes;
  for (const auto& [file, caption] : shown)
    nodes.push_back(map{{"uri", picture_uri(report / file)}, {"caption", caption}});
  return nodes;
}

}  // namespace

std::string sheet_chart(const RigConfig& rig, const RigCamera& camera, const Plane& ePl,
                        const std::vector<SheetViews>& boards) {
  ChartPanel panel{"", "elbow, degrees", "off the plane, mm", {}};
  for (std::size_t place = 0; place < boards.size(); ++place) {
    ChartCurve curve{place == 0 ? "before" : "behind", {}};
    for (const SheetView& view : boards[place].views) {
      const Transform eMc = rig.arm.bMe(view.q).inverse() * camera.bMc;
      double off = 0;
      for (const PlacedStripePoint& point : view.points) off += ePl.normal.dot(eMc * point.p) + ePl.offset;
      curve.points.push_back(
          {to_degrees(view.q[kElbow]), 1e3 * off / static_cast<double>(view.points.size()), std::nullopt});
    }
    std::sort(curve.points.begin(), curve.points.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
    panel.curves.push_back(std::move(curve));
  }
  return chart_svg({{panel}, 1});
}

void write_calibration_page(const fs::path& folder, const RigConfig& rig, const RigConfig& drawn,
                            const JointOutcome& joint, const std::optional<TruthComparison>& truth) {
  const Calibration& c = rig.calibration->values;
  const fs::path report = folder / "report";
  std::vector<Row> checks;
  for (const CalibrationCheck& check : c.checks)
    checks.push_back({check.name, fmt::format("{:.3f} {}", check.value, check.unit),
                      fmt::format("{:g} {}", check.limit, check.unit), check.passed() ? "passed" : "failed"});
  const Budget sigmas = budget_of(rig), drawings = budget_of_drawings(rig, drawn);
  const Row costs{"what", "", "laser, mm", "stereo, mm"};
  array tables{table("On data that was held back", "The calibration is accepted if every figure is within its limit.",
                     {"figure", "found", "limit", ""}, checks),
               table("What was found", "Sigmas are one standard deviation, the worst of three axes.",
                     {"part", "found", "known to", "from"}, found_rows(c, drawn)),
               table("All steps together",
                     joint.why + ". What the measurements err, by all of them, and what would have to have moved.",
                     {"measurements", "number", "sigma", ""}, joint_rows(joint)),
               table("What the uncertainties cost",
                     "Millimetres off the object's surface, root mean square over it, for one sigma of each.", costs,
                     budget_rows(sigmas)),
               table("What the rig file's own values would cost",
                     "The same, for the whole difference between the rig file's values and those found.", costs,
                     budget_rows(drawings))};
  if (truth)
    tables.push_back(table("In truth",
                           "Of the simulated tank: how far places come to lie off the object, root mean square.",
                           {"", "laser, mm", "stereo, mm"}, truth_rows(*truth)));
  const std::string file = rig.calibration->file.string();
  write_file_durably(
      report / "calibration.html",
      mstch::render(
          kCalibrationTemplate,
          map{{"title", "Calibration of " + rig.name},
              {"verdict", std::string(name_of(c.verdict))},
              {"summary",
               fmt::format("Its uncertainties cost {:.2f} mm by laser and {:.2f} mm by stereo on the object; the rig "
                           "file's own values would cost {:.1f} mm and {:.1f} mm.",
                           1e3 * sigmas.laser, 1e3 * sigmas.stereo, 1e3 * drawings.laser, 1e3 * drawings.stereo)},
              {"tables", tables},
              {"charts", array{map{{"heading", std::string("The laser's sheet over the elbow's angle")},
                                   {"svg", read_whole_file(report / "sheet.svg")},
                                   {"caption", std::string("A dot is the mean of one frame's stripe on the way there, "
                                                           "on the board before the object or behind it. It stays at "
                                                           "zero if the arm's links are right.")}}}},
              {"pictures", pictures(report, drawn.cameras)},
              {"commands", "tankrig scan --rig " + rig.name + " --calibration " + file + "\n" +
                               "tankrig calibrate check --rig " + rig.name + " --calibration " + file},
              {"made", c.made_utc + ", tankrig " + c.software}}));
}

}  // namespace tankrig::app
