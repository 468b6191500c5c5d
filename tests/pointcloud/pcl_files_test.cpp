// PCL and our readers and writers agree on every field of a cloud.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#define PCL_NO_PRECOMPILE  // PCL's file templates for a point type of ours
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include "reconstruction/cloud/cloud_io.hpp"
#include "reconstruction/pointcloud/pcl_conversion.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

PointCloud every_field() {
  PointCloud cloud{"b", {}, 0};
  for (int i = 0; i < 500; ++i) {
    const float t = 0.01f * static_cast<float>(i);
    CloudPoint point;
    point.p = Vector3d(std::sin(t), -std::cos(t), 0.1f * t).cast<float>().cast<double>();
    point.intensity = 0.002f * static_cast<float>(i);
    point.frame = i - 1;
    point.column = 1.25f * static_cast<float>(i);
    point.sigma = 1e-5f * static_cast<float>(i);
    point.normal = Eigen::Vector3f(std::sin(t), 0, std::cos(t)).normalized();
    cloud.points.push_back(point);
  }
  return cloud;
}

void expect_equal(const PointCloud& found, const PointCloud& expected) {
  ASSERT_EQ(found.points.size(), expected.points.size());
  for (std::size_t i = 0; i < found.points.size(); ++i) {
    const CloudPoint &a = found.points[i], &b = expected.points[i];
    EXPECT_EQ(a.p.cast<float>(), b.p.cast<float>());
    EXPECT_EQ(a.intensity, b.intensity);
    EXPECT_EQ(a.frame, b.frame);
    EXPECT_EQ(a.column, b.column);
    EXPECT_EQ(a.sigma, b.sigma);
    EXPECT_EQ(a.normal, b.normal);
  }
}

TEST(PclConversion, GivesBackEveryFieldAndTheFrame) {
  const PointCloud cloud = every_field(), back = from_pcl(*to_pcl<PclPoint>(cloud));
  EXPECT_EQ(back.frame, "b");
  expect_equal(back, cloud);
}

TEST(PclConversion, CountsPointsThatAreNotFinite) {
  auto cloud = to_pcl<pcl::PointXYZ>(every_field());
  (*cloud)[7].y = std::nanf("");
  const PointCloud back = from_pcl(*cloud);
  EXPECT_EQ(back.invalid, 1u);
  EXPECT_EQ(back.points.size(), 499u);
}

TEST(PclFiles, WhatPclWritesOurReaderReads) {
  const TemporaryFolder folder;
  const PointCloud cloud = every_field();
  const auto pcl_cloud = to_pcl<PclPoint>(cloud);
  pcl::PCLPointCloud2 blob;
  pcl::toPCLPointCloud2(*pcl_cloud, blob);
  pcl::PCDWriter pcd;
  const std::string name = (folder.path() / "a.pcd").string(), ply = (folder.path() / "a.ply").string();
  pcd.writeBinary(name, *pcl_cloud);
  expect_equal(read_cloud(name), cloud);
  pcd.writeBinaryCompressed(name, *pcl_cloud);
  expect_equal(read_cloud(name), cloud);
  pcd.writeASCII(name, *pcl_cloud, 9);
  expect_equal(read_cloud(name), cloud);
  for (const bool binary : {true, false}) {
    ASSERT_EQ(pcl::PLYWriter().write(ply, blob, Eigen::Vector4f::Zero(), Eigen::Quaternionf::Identity(), binary, false),
              0);
    if (binary)
      expect_equal(read_cloud(ply), cloud);
    else
      EXPECT_LT((read_cloud(ply).points[400].p - cloud.points[400].p).norm(), 1e-5) << "PCL writes few digits";
  }
}

TEST(PclFiles, WhatOurWriterWritesPclReads) {
  const TemporaryFolder folder;
  const PointCloud cloud = every_field();
  for (const CloudEncoding encoding : {CloudEncoding::kBinary, CloudEncoding::kAscii}) {
    pcl::PointCloud<PclPoint> back;
    const std::string pcd = (folder.path() / "a.pcd").string(), ply = (folder.path() / "a.ply").string();
    write_cloud(pcd, cloud, encoding);
    ASSERT_EQ(pcl::PCDReader().read(pcd, back), 0);
    expect_equal(from_pcl(back), cloud);
    write_cloud(ply, cloud, encoding);
    ASSERT_EQ(pcl::PLYReader().read(ply, back), 0);
    expect_equal(from_pcl(back), cloud);
  }
}

}  // namespace
}  // namespace tankrig
