// Clouds on disk: ours come back whole, other programs' are read, damaged ones are refused with their place.
#include "reconstruction/cloud/cloud_io.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "core/input_error.hpp"

namespace tankrig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CloudIo : public testing::Test {
 protected:
  CloudIo() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() / ("tankrig_cloud_" + std::to_string(getpid()) + "_" + info->name());
    fs::create_directories(folder_);
  }
  ~CloudIo() override { fs::remove_all(folder_); }

  fs::path file(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }

  std::string error_of(const fs::path& path) const {
    try {
      read_cloud(path);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  }

  fs::path folder_;
};

template <class T>
std::string bytes(T value, bool big_endian = false) {
  std::string out(sizeof(T), '\0');
  std::memcpy(out.data(), &value, sizeof(T));
  if (big_endian) std::reverse(out.begin(), out.end());
  return out;
}

PointCloud some_cloud() {
  PointCloud cloud;
  cloud.frame = "b";
  for (int i = 0; i < 50; ++i) {
    CloudPoint point;
    point.p = {0.1f * static_cast<float>(i), -1.25f, 1.0f / static_cast<float>(i + 3)};
    point.intensity = static_cast<float>(i) / 50;
    point.frame = i - 1;
    point.column = 3.5f * static_cast<float>(i);
    point.sigma = 1e-4f * static_cast<float>(i);
    cloud.points.push_back(point);
  }
  return cloud;
}

TEST_F(CloudIo, GivesBackEverythingInBothFormatsAndEncodings) {
  const PointCloud cloud = some_cloud();
  for (const char* name : {"a.ply", "a.pcd", "a.PLY"})
    for (const CloudEncoding encoding : {CloudEncoding::kBinary, CloudEncoding::kAscii}) {
      write_cloud(folder_ / name, cloud, encoding);
      const PointCloud back = read_cloud(folder_ / name);
      EXPECT_EQ(back.frame, "b");
      ASSERT_EQ(back.points.size(), cloud.points.size());
      for (std::size_t i = 0; i < cloud.points.size(); ++i) {
        EXPECT_LT((back.points[i].p - cloud.points[i].p).norm(), 1e-6);
        EXPECT_EQ(back.points[i].intensity, cloud.points[i].intensity);
        EXPECT_EQ(back.points[i].frame, cloud.points[i].frame);
        EXPECT_EQ(back.points[i].column, cloud.points[i].column);
        EXPECT_EQ(back.points[i].sigma, cloud.points[i].sigma);
      }
    }
}

TEST_F(CloudIo, KeepsAnEmptyCloudEmpty) {
  for (const char* name : {"e.ply", "e.pcd"}) {
    write_cloud(folder_ / name, PointCloud{});
    EXPECT_TRUE(read_cloud(folder_ / name).points.empty());
  }
}

TEST_F(CloudIo, ReadsAsciiPlyWithOtherElementsListsAndOrder) {
  const auto path =
      file("a.ply",
           "ply\r\nformat ascii 1.0\r\ncomment made elsewhere\r\nobj_info x\r\nelement camera 1\r\nproperty "
           "list uchar int ids\r\nproperty float f\r\nelement vertex 3\r\nproperty uchar "
           "intensity\r\nproperty double z\r\nproperty double y\r\nproperty list uchar float extra\r\nproperty "
           "double x\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n3 1 2 3 "
           "0.5\r\n255 3 2 0 1\r\n51 6 5 2 9.5 9 4\r\n0 nan 0 0 0\r\n3 0 1 2\r\n");
  const PointCloud cloud = read_cloud(path);
  ASSERT_EQ(cloud.points.size(), 2u);
  EXPECT_EQ(cloud.frame, "") << "it names none";
  EXPECT_EQ(cloud.points[0].p, Vector3d(1, 2, 3));
  EXPECT_EQ(cloud.invalid, 1u);
  EXPECT_EQ(cloud.points[1].p, Vector3d(4, 5, 6));
  EXPECT_FLOAT_EQ(cloud.points[0].intensity, 1.0f);
  EXPECT_FLOAT_EQ(cloud.points[1].intensity, 0.2f);
}

TEST_F(CloudIo, ReadsBinaryPlyOfBothByteOrders) {
  for (const bool big : {false, true}) {
    std::string text = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                       "_endian 1.0\nelement face 1\nproperty list uchar int i\nelement vertex 2\nproperty double x\n"
                       "property float y\nproperty short z\nproperty uchar red\nend_header\n";
    text += bytes<std::uint8_t>(2) + bytes<std::int32_t>(7, big) + bytes<std::int32_t>(8, big);
    for (int i = 0; i < 2; ++i)
      text += bytes<double>(1.5 + i, big) + bytes<float>(-2.5f, big) + bytes<std::int16_t>(-300, big) + "r";
    const PointCloud cloud = read_cloud(file("a.ply", text));
    ASSERT_EQ(cloud.points.size(), 2u);
    EXPECT_EQ(cloud.points[1].p, Vector3d(2.5, -2.5, -300));
  }
}

TEST_F(CloudIo, ReadsAsciiPcdWithCountsAndPadding) {
  const auto path =
      file("a.pcd",
           "# .PCD v.7\nVERSION .7\nFIELDS normal _ z x y\nSIZE 4 1 8 4 4\nTYPE F U F F I\nCOUNT 3 2 1 1 1\n"
           "WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n0 0 1 0 0 3 1 2\n0 0 1 0 0 nan "
           "4 5\n");
  const PointCloud cloud = read_cloud(path);
  ASSERT_EQ(cloud.points.size(), 1u);
  EXPECT_EQ(cloud.invalid, 1u);
  EXPECT_EQ(transformed(Transform::Identity(), cloud, "o").invalid, 1u);
  EXPECT_EQ(cloud.points[0].p, Vector3d(1, 2, 3));
}

TEST_F(CloudIo, ReadsBinaryPcdRecords) {
  std::string text = "FIELDS y x rgb z\nSIZE 8 4 4 4\nTYPE F F U F\nWIDTH 1\nHEIGHT 2\nDATA binary\n";
  for (int i = 0; i < 2; ++i)
    text += bytes<double>(2) + bytes<float>(1) + bytes<std::uint32_t>(9) + bytes<float>(3.0f + i);
  const PointCloud cloud = read_cloud(file("a.pcd", text));
  ASSERT_EQ(cloud.points.size(), 2u);
  EXPECT_EQ(cloud.points[1].p, Vector3d(1, 2, 4));
}

TEST_F(CloudIo, UnpacksCompressedPcd) {
  // Columns x, y, z of four equal points: 4 literal bytes, then a repetition of 12 bytes 4 back, for each column.
  std::string packed;
  for (const float value : {1.0f, 2.0f, 3.0f}) {
    packed += std::string(1, '\3') + bytes(value);
    packed +=
        std::string(1, static_cast<char>(7 << 5)) + std::string(1, static_cast<char>(12 - 9)) + std::string(1, '\3');
  }
  const std::string header =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA binary_compressed\n";
  const std::string sizes = bytes<std::uint32_t>(static_cast<std::uint32_t>(packed.size())) + bytes<std::uint32_t>(48);
  const PointCloud cloud = read_cloud(file("a.pcd", header + sizes + packed));
  ASSERT_EQ(cloud.points.size(), 4u);
  for (const CloudPoint& point : cloud.points) EXPECT_EQ(point.p, Vector3d(1, 2, 3));
  const std::string none = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 0\nHEIGHT 1\nDATA binary_compressed\n";
  EXPECT_TRUE(read_cloud(file("none.pcd", none)).points.empty());
  packed[5] = '\x01';
  EXPECT_THAT(error_of(file("damaged.pcd", header + sizes + packed)), HasSubstr("LZF"));
  EXPECT_THAT(error_of(file("short.pcd", header + sizes + packed.substr(0, 9))), HasSubstr("found 9 compressed bytes"));
}

TEST_F(CloudIo, NamesTheLineOfAMalformedHeader) {
  EXPECT_THAT(error_of(file("a.ply", "ply\nformat ascii 1.0\nelement vertex many\n")), HasSubstr("a.ply:3: "));
  EXPECT_THAT(error_of(file("b.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n")),
              HasSubstr("b.ply:4: found type 'quad'"));
  EXPECT_THAT(error_of(file("c.ply", "plx\n")), HasSubstr("c.ply:1: found 'plx'"));
  EXPECT_THAT(
      error_of(
          file("d.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nend_header\n")),
      HasSubstr("no property 'z'"));
  EXPECT_THAT(error_of(file("a.pcd", "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 four\n")),
              HasSubstr("a.pcd:3: SIZE: found 'four'"));
  EXPECT_THAT(error_of(file("b.pcd", "FIELDS x y z\nSIZE 4 4\nTYPE F F F\nWIDTH 1\nDATA ascii\n")),
              HasSubstr("SIZE: found 2 values, expected 3"));
  EXPECT_THAT(error_of(file("c.pcd", "FIELDS x y\nSIZE 4 4\nTYPE F F\nWIDTH 1\nDATA ascii\n")), HasSubstr("no 'z'"));
  EXPECT_THAT(error_of(file("e.pcd", "FIELDS x y z\nDATA zipped\n")), HasSubstr("e.pcd:2: DATA: found 'zipped'"));
}

TEST_F(CloudIo, SaysHowManyPointsOfATruncatedFileItFound) {
  for (const char* name : {"a.ply", "a.pcd"}) {
    write_cloud(folder_ / name, some_cloud());
    fs::resize_file(folder_ / name, fs::file_size(folder_ / name) - 28 * 10 - 1);
    EXPECT_THAT(error_of(folder_ / name), HasSubstr("found 39 points, expected 50"));
  }
  EXPECT_THAT(error_of(file("t.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA ascii\n1 2 3\n4 5\n")),
              HasSubstr("found 1 points, expected 2"));
  EXPECT_THAT(error_of(file("u.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA ascii\n1 2 3\n4 five 6\n")),
              HasSubstr("u.pcd:7: y: found 'five'"));
}

TEST_F(CloudIo, RefusesWhatIsNotACloud) {
  EXPECT_THAT(error_of(folder_ / "none.ply"), HasSubstr("cannot be read"));
  EXPECT_THAT(error_of(folder_ / "a.xyz"), HasSubstr("expected .ply or .pcd"));
  fs::create_directory(folder_ / "d.ply");
  EXPECT_THAT(error_of(folder_ / "d.ply"), HasSubstr("is a folder"));
}

TEST_F(CloudIo, LeavesNothingBehindWhenTheFileCannotBeWritten) {
  EXPECT_THROW(write_cloud(folder_ / "no" / "a.ply", some_cloud()), InputError);
  fs::create_directories(folder_ / "taken.ply/by something");
  EXPECT_THROW(write_cloud(folder_ / "taken.ply", some_cloud()), InputError);
  EXPECT_FALSE(fs::exists(folder_ / "taken.ply.tmp"));
}

}  // namespace
}  // namespace tankrig
