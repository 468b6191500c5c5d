// Mesh files in, JSON and coloured clouds out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bench/metrics/metrics_json.hpp"
#include "bench/metrics/verdict_cloud.hpp"
#include "core/input_error.hpp"
#include "tests/metrics/shapes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;
using testing::Not;

const TemporaryFolder& folder() {
  static const TemporaryFolder folder;
  return folder;
}

std::filesystem::path file_with(const std::string& name, const std::string& text) { return folder().write(name, text); }

std::string error_of(const std::filesystem::path& file) {
  try {
    read_mesh(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

const char* kCubeOfQuads =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

TEST(ReadMesh, AnObjectOfImplausibleSizeIsQuestionedWithItsSizeAndUnit) {
  const auto box = [](const std::string& side) {
    return "v 0 0 0\nv " + side + " 0 0\nv 0 " + side + " 0\nv 0 0 " + side + "\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  };
  EXPECT_THAT(error_of(file_with("millimetres.obj", box("140"))),
              HasSubstr("millimetres.obj: found an object of 140 m"));
  EXPECT_THAT(error_of(file_with("millimetres.obj", box("140"))), HasSubstr("looks like millimetres"));
  EXPECT_THAT(error_of(file_with("tiny.obj", box("0.00014"))), HasSubstr("found an object of 0.00014 m"));
  EXPECT_EQ(error_of(file_with("metres.obj", box("0.14"))), "no error");
}

TEST(ReadMesh, CutsQuadsIntoTrianglesAndWeldsThem) {
  const TriangleMesh mesh = read_mesh(file_with("cube.obj", kCubeOfQuads));
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_NEAR(mesh.area(), 6.0, 1e-12);
  EXPECT_NEAR(mesh.signed_volume(), 1.0, 1e-12);
  EXPECT_TRUE(topology(mesh).outward);
  EXPECT_EQ(mesh.bounds().min(), Vector3d(0, 0, 0));
  EXPECT_EQ(mesh.bounds().max(), Vector3d(1, 1, 1));
}

TEST(ReadMesh, TurnsInwardNormalsOut) {
  std::string inward = kCubeOfQuads;
  inward = inward.substr(0, inward.find("f ")) + "f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n";
  EXPECT_NEAR(read_mesh(file_with("inward.obj", inward)).signed_volume(), 1.0, 1e-12);
}

TEST(ReadMesh, AppliesTheNodesOfAScene) {
  // One triangle in glTF, its node scaled by 2 in a node moved by (10, 0, 0); the buffer holds three float corners.
  const char* gltf = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
    "nodes":[{"children":[1],"translation":[10,0,0]},{"mesh":0,"scale":[2,2,2]}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],
    "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
  const TriangleMesh mesh = read_mesh(file_with("node.gltf", gltf));
  EXPECT_NEAR(mesh.area(), 2.0, 1e-6);
  EXPECT_TRUE(mesh.bounds().min().isApprox(Vector3d(10, 0, 0), 1e-6)) << mesh.bounds().min().transpose();
  EXPECT_FALSE(topology(mesh).closed);
}

std::string little_endian(std::uint32_t number) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(number >> 8 * i & 0xff);
  return bytes;
}

TEST(ReadMesh, ReadsABinaryGltfThatIsWholeAndRefusesAnyOtherUnread) {
  std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],
    "buffers":[{"byteLength":36}]})";
  json.append((4 - json.size() % 4) % 4, ' ');
  const std::string zero = little_endian(0), one = little_endian(0x3f800000);  // as floats
  const std::string corners = zero + zero + zero + one + zero + zero + zero + one + zero;
  const auto glb = [&](std::uint32_t whole, std::uint32_t first) {
    return "glTF" + little_endian(2) + little_endian(whole) + little_endian(first) + "JSON" + json + little_endian(36) +
           std::string("BIN\0", 4) + corners;
  };
  const auto bytes = static_cast<std::uint32_t>(json.size()), all = bytes + 20 + 8 + 36;
  EXPECT_NEAR(read_mesh(file_with("whole.glb", glb(all, bytes))).area(), 0.5, 1e-6);
  for (const auto& [whole, first] : {std::pair{all, 0xffffffffu}, {all + 1, bytes}, {all, all - 19}})
    for (const char* name : {"not_whole.glb", "not_whole.obj"})
      EXPECT_THAT(error_of(file_with(name, glb(whole, first))), HasSubstr("expected a binary glTF that is whole"));
  EXPECT_THAT(error_of(file_with("cut.glb", "glTF")), HasSubstr("expected a binary glTF that is whole"));
  EXPECT_THAT(error_of(file_with("other.glb", "no such thing at all")),
              HasSubstr("found no glTF header in a file of 20 bytes"));
}

TEST(ReadMesh, RefusesAHeaderThatStatesMoreElementsThanTheFileHasBytes) {
  const std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 400000000\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" +
      std::string(100, '\0');
  for (const auto& [name, text] :
       {std::pair<const char*, std::string>{"many.ply", ply}, {"many.off", "OFF\n# by hand\n400000000 1 0\n0 0 0\n"}})
    EXPECT_THAT(error_of(file_with(name, text)), HasSubstr("found 400000000 elements in a file of ")) << name;
  EXPECT_NEAR(read_mesh(file_with("one.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).area(), 0.5, 1e-12);
}

TEST(ReadMesh, WaitsForNoPipeNorDoesAFileThatItNames) {
  const auto pipe = folder().path() / "pipe.obj";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(error_of(pipe), HasSubstr("pipe.obj: is a pipe, a socket or a device, expected a triangle mesh file"));
  EXPECT_EQ(read_mesh(file_with("names.obj", std::string("mtllib pipe.obj\n") + kCubeOfQuads)).triangles.size(), 12u);
}

TEST(ReadMesh, ReadsPlyAndStl) {
  const char* ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_NEAR(read_mesh(file_with("one.ply", ply)).area(), 0.5, 1e-12);
  const char* stl =
      "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid "
      "s\n";
  EXPECT_NEAR(read_mesh(file_with("one.stl", stl)).area(), 0.5, 1e-12);
}

TEST(ReadMesh, SaysInOneLineWhatIsWrong) {
  EXPECT_THAT(error_of("/nonexistent/box.ply"), HasSubstr("/nonexistent/box.ply: cannot be read, expected"));
  EXPECT_THAT(error_of(file_with("bad.ply", "this is no mesh\n")), HasSubstr("expected"));
  EXPECT_THAT(error_of(file_with("bad.xyzzy", "this is no mesh\n")), HasSubstr("expected"));
  const char* points =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
      "0 0 0\n1 0 0\n";
  EXPECT_THAT(error_of(file_with("points.ply", points)), HasSubstr("expected"));
  EXPECT_THAT(error_of(file_with("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")), HasSubstr("expected"));
  for (const char* name : {"bad.ply", "bad.xyzzy", "points.ply", "flat.obj"})
    EXPECT_THAT(error_of(folder().path() / name), Not(HasSubstr("\n")));
}

TEST(Topology, KnowsOpenAndTornMeshes) {
  EXPECT_TRUE(topology(shapes::tank_box()).outward);
  EXPECT_TRUE(topology(shapes::icosphere(1, 2)).outward);
  EXPECT_FALSE(topology(shapes::square(1)).closed);
  TriangleMesh torn = shapes::tank_box();
  std::swap(torn.triangles[3][0], torn.triangles[3][1]);
  EXPECT_FALSE(topology(torn).closed) << "one face is turned over";
}

TEST(MetricsJson, HasEveryKeyAndNullWhereNothingIsDefined) {
  const ObjectSurface box(shapes::tank_box(), 20'000);
  const nlohmann::json j = to_json(evaluate(PointCloud{}, box, MetricThresholds{}));
  for (const char* key : {"mean_error_m", "stddev_m", "median_m", "rms_m", "p95_m", "bias_m", "outliers", "rejected",
                          "coverage_ceiling", "coverage_of_ceiling"})
    EXPECT_TRUE(j.at(key).is_null()) << key;
  for (const char* key : {"points", "ground_points", "outlier_count", "coverage"}) EXPECT_EQ(j.at(key), 0) << key;
  for (const char* key : {"0.002", "0.005", "0.010"}) {
    EXPECT_EQ(j.at("coverage_at").at(key), 0.0);
    EXPECT_TRUE(j.at("coverage_of_ceiling_at").at(key).is_null());
  }
  for (const char* key : {"inlier_m", "outlier_m", "coverage_m", "coverage_headline_m", "ground_band_m",
                          "max_incidence_deg", "ground_plane", "surface_samples"})
    EXPECT_TRUE(j.at("thresholds").contains(key)) << key;
  EXPECT_NEAR(j.at("thresholds").at("max_incidence_deg"), 75.0, 1e-9);
}

TEST(MetricsJson, GivesTheFiguresOfACloud) {
  const ObjectSurface box(shapes::tank_box(), 20'000);
  Ceiling ceiling;
  ceiling.reachable.assign(box.samples().size(), 1);
  ceiling.share = 1;
  const auto cloud = shapes::cloud_of({{0, 0, 0.001}, {0, 0, 0.003}, {0, 0, 0.5}});
  const nlohmann::json j = to_json(evaluate(cloud, box, MetricThresholds{}, &ceiling));
  EXPECT_NEAR(j.at("mean_error_m"), 0.002, 1e-12);
  EXPECT_NEAR(j.at("bias_m"), 0.002, 1e-12);
  EXPECT_NEAR(j.at("outliers"), 1.0 / 3, 1e-12);
  EXPECT_EQ(j.at("coverage"), j.at("coverage_at").at("0.010"));
  EXPECT_EQ(j.at("coverage_of_ceiling"), j.at("coverage"));
  EXPECT_EQ(j.at("coverage_ceiling"), 1.0);
}

TEST(MetricsJson, OfTheReferenceNamesItsOdditiesAndItsThresholds) {
  const nlohmann::json j = to_json(uwsim_metrics(shapes::cloud_of({{0, 0, 0.001}}), shapes::tank_box()));
  EXPECT_EQ(j.at("definition"), "uwsim");
  EXPECT_TRUE(j.at("error_variance_m2").is_null());
  EXPECT_EQ(j.at("thresholds").at("outlier_m"), 0.15);
  EXPECT_GE(j.at("oddities").size(), 8u);
  EXPECT_EQ(j.at("lattice").at("nodes"), nlohmann::json({15, 30, 17}));
}

TEST(VerdictCloud, IsGroundBlackObjectGreenOutliersBlue) {
  PointCloud cloud = shapes::cloud_of({{1, 2, 3}, {0, 0, 0}, {-1, 0, 0.5}, {NAN, 0, 0}});
  const auto file = folder().path() / "verdicts.ply";
  cloud.points[1].sigma = 0.25F;
  Metrics metrics;
  metrics.verdicts = {PointVerdict::kGround, PointVerdict::kObject, PointVerdict::kOutlier, PointVerdict::kRejected};
  metrics.distances = {3, 0.5, 1, NAN};
  write_verdict_cloud(file, cloud, metrics);
  std::ifstream in(file, std::ios::binary);
  std::stringstream all;
  all << in.rdbuf();
  const std::string text = all.str();
  const std::size_t body = text.find("end_header\n") + 11;
  EXPECT_THAT(text.substr(0, body), HasSubstr("element vertex 3\n"));
  ASSERT_EQ(text.size() - body, 69u);
  const auto colour = [&](int i) { return text.substr(body + 23 * i + 20, 3); };
  EXPECT_EQ(colour(0), std::string("\0\0\0", 3));
  EXPECT_EQ(colour(1), std::string("\0\xC8\0", 3));
  EXPECT_EQ(colour(2), std::string("\0\0\xFF", 3));
  float x;
  std::memcpy(&x, text.data() + body, 4);
  EXPECT_EQ(x, 1.0F);
  float error_and_sigma[2];
  std::memcpy(error_and_sigma, text.data() + body + 23 + 12, 8);
  EXPECT_EQ(error_and_sigma[0], 0.5F);
  EXPECT_EQ(error_and_sigma[1], 0.25F);
}

TEST(VerdictCloud, LeavesNothingBehindWhereItCannotWrite) {
  EXPECT_THROW(write_verdict_cloud("/nonexistent/folder/cloud.ply", PointCloud{}, {}), InputError);
  Metrics of_another;
  of_another.verdicts = {PointVerdict::kGround};
  EXPECT_THROW(write_verdict_cloud("cloud.ply", PointCloud{}, of_another), InputError);
}

}  // namespace
}  // namespace tankrig
