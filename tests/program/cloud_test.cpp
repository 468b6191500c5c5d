// `tankrig cloud` as a user runs it, on written clouds and on scans of an object that was turned.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <iomanip>
#include <numbers>
#include <random>

#include "core/model_yaml.hpp"
#include "reconstruction/cloud/cloud_io.hpp"
#include "tests/pointcloud/seen_prism.hpp"
#include "tests/program/program.hpp"

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

namespace tankrig::test {
namespace {

const std::string kBox = (fs::path(TANKRIG_SOURCE_DIR) / "etc/objects/black_box.obj").string();

std::string in_scratch(const std::string& name) {
  fs::create_directories(scratch_folder());
  return (scratch_folder() / name).string();
}

/// Three faces of the box and the floor around it, in frame o, 3 mm apart, with noise of 0.3 mm.
PointCloud box_on_floor() {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.0003);
  PointCloud cloud{"o", {}, 0};
  const auto add = [&](double x, double y, double z) {
    CloudPoint point;
    point.p = Vector3d(x + noise(random), y + noise(random), z + noise(random));
    cloud.points.push_back(point);
  };
  for (double a = -0.07; a <= 0.07; a += 0.003)
    for (double b = -0.15; b <= 0.15; b += 0.003) add(a, b, 0);
  for (double b = -0.15; b <= 0.15; b += 0.003)
    for (double c = -0.155; c <= 0; c += 0.003) add(0.07, b, c);
  for (double a = -0.07; a <= 0.07; a += 0.003)
    for (double c = -0.155; c <= 0; c += 0.003) add(a, 0.15, c);
  for (double a = -0.3; a <= 0.3; a += 0.006)
    for (double b = -0.3; b <= 0.3; b += 0.006)
      if (std::abs(a) > 0.075 || std::abs(b) > 0.155) add(a, b, -0.16);
  return cloud;
}

std::string written(const std::string& name, const PointCloud& cloud) {
  write_cloud(in_scratch(name), cloud);
  return in_scratch(name);
}

std::string pose_file(const std::string& name, const Transform& cMo) {
  write_text(in_scratch(name), yaml_of(cMo) + "\n");
  return in_scratch(name);
}

json done(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "cloud");
  arguments.emplace_back("--json");
  const ProgramRun run = run_tankrig(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.exit_code == 0 ? run.json() : json{};
}

std::string refused(std::vector<std::string> arguments, const std::string& out) {
  arguments.insert(arguments.begin(), "cloud");
  const ProgramRun run = run_tankrig(arguments);
  EXPECT_EQ(run.exit_code, 1) << run.out;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_FALSE(fs::exists(out));
  return run.err;
}

TEST(Cloud, OperationsWriteWhatTheySay) {
  const PointCloud cloud = box_on_floor();
  const std::string file = written("a.ply", cloud);
  const json convert = done({"convert", file, "--out", in_scratch("b.pcd"), "--ascii"});
  EXPECT_EQ(convert.at("points"), cloud.points.size());
  EXPECT_EQ(read_cloud(in_scratch("b.pcd")).frame, "o");
  const json crop = done({"crop", file, "--min", "-1,-1,-0.155", "--max", "1,1,1", "--out", in_scratch("crop.ply")});
  EXPECT_EQ(crop.at("points"), read_cloud(in_scratch("crop.ply")).points.size());
  EXPECT_LT(crop.at("points"), cloud.points.size());
  EXPECT_LT(done({"voxel", file, "--edge", "0.01", "--out", in_scratch("voxel.ply")}).at("points"),
            cloud.points.size() / 2);
  EXPECT_GT(done({"outliers", file, "--out", in_scratch("clean.ply")}).at("points"), cloud.points.size() * 9 / 10);
  const json floor = done({"floor", file, "--out", in_scratch("object.ply")});
  EXPECT_NEAR(floor.at("plane")[3].get<double>(), 0.16, 0.001);
  const json normals =
      done({"normals", in_scratch("object.ply"), "--seen-from", "1,1,0.6", "--out", in_scratch("n.ply")});
  EXPECT_EQ(normals.at("frame"), "o");
  EXPECT_TRUE(read_cloud(in_scratch("n.ply")).has_normals());
  for (const std::string method : {"poisson", "greedy"})
    EXPECT_GT(
        done({"mesh", in_scratch("n.ply"), "--method", method, "--out", in_scratch(method + ".stl")}).at("triangles"),
        1000);
}

TEST(Cloud, MillimetresAndPosesAreConverted) {
  PointCloud cloud{"", {}, 0};
  CloudPoint point;
  point.p = {100, 200, 300};
  cloud.points.push_back(point);
  const std::string pose = pose_file("pose.yaml", Transform(Eigen::Translation3d(1, 0, 0)));
  done({"convert", written("mm.ply", cloud), "--millimetres", "--frame", "b", "--pose", pose, "--out",
        in_scratch("b.ply")});
  const PointCloud found = read_cloud(in_scratch("b.ply"));
  EXPECT_EQ(found.frame, "b");
  EXPECT_LT((found.points.at(0).p - Vector3d(1.1, 0.2, 0.3)).norm(), 1e-6);
}

TEST(Cloud, AlignFindsThePoseThatEvaluateTakes) {
  const Transform truth = make_transform_rpy({0.3, -0.1, 0.8}, {0.3, 0.2, 1}),
                  guess = truth * make_transform_rpy({0.008, -0.005, 0.006}, {0.02, 0, -0.03});
  const PointCloud cloud = transformed(truth, box_on_floor(), "c");
  const std::string file = written("c.ply", cloud), found = in_scratch("found.yaml");
  const json aligned = done({"align", file, "--object", kBox, "--pose", pose_file("guess.yaml", guess), "--pose-out",
                             found, "--out", in_scratch("aligned.ply")});
  EXPECT_EQ(aligned.at("frame"), "o");
  EXPECT_EQ(read_cloud(in_scratch("aligned.ply")).points.size(), cloud.points.size());
  const json score = run_tankrig({"evaluate", file, "--object", kBox, "--pose", found, "--json"}).json();
  EXPECT_LT(score.at("mean_error_m").get<double>(), 0.0004);
}

TEST(Cloud, EvaluateHasARowOfTheAlignedCloudBesideTheGiven) {
  const Transform wrong = make_transform_rpy({0.003, 0.002, -0.004}, {0.01, 0, 0.01});
  const std::string file = written("o.ply", box_on_floor()), pose = pose_file("pose.yaml", wrong);
  const json score = run_tankrig({"evaluate", file, "--object", kBox, "--pose", pose, "--json"}).json();
  const json& aligned = score.at("aligned");
  EXPECT_GT(score.at("mean_error_m").get<double>(), 0.002);
  EXPECT_LT(aligned.at("mean_error_m").get<double>(), 0.0004);
  EXPECT_NEAR(aligned.at("transform").at("rotation_deg").get<double>(), 0.81, 0.03);
  EXPECT_EQ(aligned.at("transform").at("matrix").size(), 4u);
  const ProgramRun table = run_tankrig({"evaluate", file, "--object", kBox, "--pose", pose});
  EXPECT_THAT(table.out, HasSubstr("\ncloud aligned"));
  EXPECT_THAT(table.out, HasSubstr("\naligned: moved by ("));
}

TEST(Cloud, RefusesWhatWouldBeLostOrGuessed) {
  const std::string file = written("a.ply", box_on_floor()), out = in_scratch("out.ply");
  PointCloud nowhere = box_on_floor();
  nowhere.frame = "c";
  const std::string other = written("c.ply", nowhere);
  const ProgramRun over = run_tankrig({"cloud", "voxel", file, "--out", file});
  EXPECT_EQ(over.exit_code, 1);
  EXPECT_THAT(over.err, HasSubstr("exists already"));
  EXPECT_EQ(read_cloud(file).points.size(), box_on_floor().points.size());
  EXPECT_THAT(refused({"normals", file, "--out", out}, out), HasSubstr("expected --seen-from"));
  EXPECT_THAT(refused({"floor", other, "--out", out}, out), HasSubstr("expected --up"));
  EXPECT_THAT(refused({"crop", file, "--min", "1,0,0", "--max", "0,1,1", "--out", out}, out), HasSubstr("--min"));
  EXPECT_THAT(refused({"merge", file, file, "--out", out}, out), HasSubstr("normal"));
  EXPECT_THAT(refused({"merge", file, other, "--object", kBox, "--out", out}, out), HasSubstr("frame c"));
  EXPECT_THAT(refused({"mesh", file, "--out", out}, out), HasSubstr("expected --seen-from"));
  EXPECT_EQ(run_tankrig({"cloud", "align", file}).exit_code, 2) << "on what?";
}

/// The tank-sim rig with its box, or with the mesh in `object` if there is one, turned about its upright axis.
fs::path turned_rig(const std::string& name, double degrees, const std::string& object) {
  const fs::path rig = edited_rig(scratch_folder() / name, "dark_frames: 10", "dark_frames: 2");
  shrink_stereo_pictures(rig);
  const double turn = degrees * std::numbers::pi / 180;
  const Eigen::Quaterniond q = Eigen::Quaterniond(0, 0.919495956, 0.393099461, 0) *
                               Eigen::Quaterniond(Eigen::AngleAxisd(turn, Vector3d::UnitZ()));
  std::ostringstream quaternion, yaw;
  quaternion << std::setprecision(9) << "quaternion_xyzw: [" << q.x() << ", " << q.y() << ", " << q.z() << ", " << q.w()
             << "]";
  yaw << std::setprecision(9) << "<y>" << -0.808 + turn << "</y></orientation>\n    <material>";
  edit(rig, {{"quaternion_xyzw: [0.919495956, 0.393099461, 0.000000000, 0.000000000]", quaternion.str()}});
  edit(rig.parent_path() / "tank.xml", {{"<y>-0.808</y></orientation>\n    <material>", yaw.str()}});
  if (!object.empty()) write_text(rig.parent_path() / "black_box.obj", object);
  return rig;
}

/// A session with the laser's cloud only.
std::string scanned(const fs::path& rig, const std::string& name) {
  const std::string out = in_scratch(name);
  bool sent = false;
  run_tankrig({"scan", "--rig", rig.string(), "--out", out}, [&](const std::string& line, int pid) {
    if (!sent && line.starts_with("reconstruct: laser")) sent = kill(pid, SIGINT) == 0;
  });
  const ProgramRun made = run_tankrig({"reconstruct", out, "--method", "laser"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  return out;
}

double coverage(const std::string& cloud, const std::string& object, const std::string& pose) {
  const ProgramRun run = run_tankrig({"evaluate", cloud, "--object", object, "--pose", pose, "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const json score = run.json();
  EXPECT_LT(score.at("mean_error_m").get<double>(), 0.001) << cloud;
  return score.at("coverage").get<double>();
}

/// As an OBJ file whose origin is where the box has it.
std::string obj_of(const shapes::Prism& prism) {
  const TriangleMesh mesh = shapes::mesh_of(prism);
  std::ostringstream obj;
  for (const Vector3d& v : mesh.vertices) obj << "v " << v.x() << ' ' << v.y() << ' ' << v.z() - prism.height << '\n';
  for (const Eigen::Vector3i& t : mesh.triangles) obj << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return obj.str();
}

TEST(CloudMerge, TwoScansOfATurnedObjectCoverMoreThanOneCanSee) {
  const std::string prism = obj_of(shapes::odd_prism());
  const std::string first = scanned(turned_rig("rig", 0, prism), "first"),
                    second = scanned(turned_rig("turned", -30, prism), "second"), out = in_scratch("whole.ply"),
                    object = (scratch_folder() / "rig/black_box.obj").string();
  const json merged = done({"merge", first, second, "--search", "--out", out});
  EXPECT_LT(merged.at("inputs")[1].at("transform").at("rms_m").get<double>(), 0.001);
  EXPECT_LT(merged.at("inputs")[1].at("transform").at("rotation_deg").get<double>(), 0.3) << "bMo says the truth";
  const std::string identity = pose_file("identity.yaml", Transform::Identity());
  const PointCloud alone = read_cloud(fs::path(first) / "clouds/laser.ply");
  ASSERT_EQ(alone.frame, "b");
  const std::string bMo = "translation_m: [-0.26, 0.025, 1.02]\nquaternion_xyzw: [0.919495956, 0.393099461, 0, 0]\n";
  write_text(in_scratch("bMo.yaml"), bMo);
  const double one = coverage((fs::path(first) / "clouds/laser.ply").string(), object, in_scratch("bMo.yaml")),
               both = coverage(out, object, identity);
  EXPECT_GT(both, one + 0.05);
}

TEST(CloudMerge, TheBoxNeedsItsMeshBecauseTwoFacesSlide) {
  const fs::path there = turned_rig("rig", 0, ""), back = turned_rig("turned", 180, "");
  for (const fs::path& rig : {there, back}) shrink_mono_pictures(rig);
  const std::string first = scanned(there, "first"), second = scanned(back, "second"), out = in_scratch("whole.ply");
  EXPECT_THAT(refused({"merge", first, second, "--out", out}, out), HasSubstr("freedoms"));
  done({"merge", first, second, "--object", kBox, "--out", out});
  EXPECT_GT(coverage(out, kBox, pose_file("identity.yaml", Transform::Identity())), 0.75) << "all but the bottom";
}

}  // namespace
}  // namespace tankrig::test
