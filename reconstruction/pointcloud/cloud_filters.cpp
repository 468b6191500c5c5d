#include "reconstruction/pointcloud/cloud_filters.hpp"

#include <pcl/filters/crop_box.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/uniform_sampling.h>
#include <pcl/filters/voxel_grid.h>

#include <cmath>
#include <limits>

#include "core/input_error.hpp"
#include "reconstruction/pointcloud/pcl_conversion.hpp"

namespace tankrig {
namespace {

/// PCL counts cubes with 32 bits, and warns of more only on the terminal.
void check_cubes(const PointCloud& cloud, double edge_m) {
  Eigen::AlignedBox3d box;
  for (const CloudPoint& point : cloud.points) box.extend(point.p);
  const double cubes = ((box.sizes() / edge_m).array().floor() + 1).prod();
  if (!(cubes < std::numeric_limits<std::int32_t>::max()))
    throw InputError("found an edge of " + std::to_string(edge_m) + " m for a cloud of " +
                     std::to_string(box.sizes().maxCoeff()) + " m, expected a larger edge, or outliers removed first");
}

}  // namespace

PointCloud selected(const PointCloud& cloud, const std::vector<int>& indices) {
  PointCloud out{cloud.frame, {}, cloud.invalid};
  out.points.reserve(indices.size());
  for (const int i : indices) out.points.push_back(cloud.points[static_cast<std::size_t>(i)]);
  return out;
}

PointCloud without(const PointCloud& cloud, const std::vector<int>& indices) {
  std::vector<char> taken(cloud.points.size(), 0);
  for (const int i : indices) taken[static_cast<std::size_t>(i)] = 1;
  PointCloud out{cloud.frame, {}, cloud.invalid};
  for (std::size_t i = 0; i < taken.size(); ++i)
    if (!taken[i]) out.points.push_back(cloud.points[i]);
  return out;
}

PointCloud cropped(const PointCloud& cloud, const Eigen::AlignedBox3d& box, bool keep_outside) {
  pcl::CropBox<pcl::PointXYZ> crop;
  crop.setInputCloud(to_pcl<pcl::PointXYZ>(cloud));
  crop.setMin(box.min().cast<float>().homogeneous());
  crop.setMax(box.max().cast<float>().homogeneous());
  crop.setNegative(keep_outside);
  std::vector<int> kept;
  crop.filter(kept);
  return selected(cloud, kept);
}

PointCloud voxel_grid(const PointCloud& cloud, double edge_m) {
  if (cloud.points.empty()) return cloud;
  check_cubes(cloud, edge_m);
  pcl::VoxelGrid<pcl::PointXYZI> grid;
  grid.setInputCloud(to_pcl<pcl::PointXYZI>(cloud));
  const auto edge = static_cast<float>(edge_m);
  grid.setLeafSize(edge, edge, edge);
  pcl::PointCloud<pcl::PointXYZI> means;
  grid.filter(means);
  PointCloud out = from_pcl(means);
  out.invalid = cloud.invalid;
  return out;
}

PointCloud thinned(const PointCloud& cloud, double edge_m) {
  if (cloud.points.empty()) return cloud;
  check_cubes(cloud, edge_m);
  pcl::UniformSampling<pcl::PointXYZ> sampling(true);
  sampling.setInputCloud(to_pcl<pcl::PointXYZ>(cloud));
  sampling.setRadiusSearch(edge_m);
  pcl::PointCloud<pcl::PointXYZ> kept;
  sampling.filter(kept);
  return without(cloud, *sampling.getRemovedIndices());
}

PointCloud without_outliers(const PointCloud& cloud, const OutlierFilter& filter) {
  if (cloud.points.empty()) return cloud;
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> removal;
  removal.setInputCloud(to_pcl<pcl::PointXYZ>(cloud));
  removal.setMeanK(filter.neighbours);
  removal.setStddevMulThresh(filter.sigmas);
  std::vector<int> kept;
  removal.filter(kept);
  return selected(cloud, kept);
}

}  // namespace tankrig
