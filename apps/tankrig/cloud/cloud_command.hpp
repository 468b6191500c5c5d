// `tankrig cloud`: what people do with clouds after a scan.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "reconstruction/cloud/cloud.hpp"

namespace tankrig::app {

/// A cloud read, and what becomes of it.
struct CloudOptions {
  std::filesystem::path cloud, out;
  bool ascii = false, json = false;
};

struct CloudConvertOptions : CloudOptions {
  bool millimetres = false;    ///< the file's coordinates are
  std::string frame;           ///< empty: as the file says
  std::filesystem::path pose;  ///< of the file's frame in `frame`; empty: only the name changes
};
int cloud_convert(const CloudConvertOptions& options);

struct CloudCropOptions : CloudOptions {
  std::vector<double> min, max;
  bool outside = false;
};
int cloud_crop(const CloudCropOptions& options);

struct CloudVoxelOptions : CloudOptions {
  double edge_m = 0.005;
};
int cloud_voxel(const CloudVoxelOptions& options);

struct NormalOptions {
  double radius_m = 0;
  std::vector<double> seen_from;  ///< empty: the origin of frame c
};
struct CloudNormalsOptions : CloudOptions, NormalOptions {};
int cloud_normals(const CloudNormalsOptions& options);

struct CloudOutliersOptions : CloudOptions {
  int neighbours = 0;
  double sigmas = 0;
};
int cloud_outliers(const CloudOutliersOptions& options);

struct CloudFloorOptions : CloudOptions {
  std::vector<double> up;  ///< empty: known from the frame
  double band_m = 0;
};
int cloud_floor(const CloudFloorOptions& options);

struct CloudAlignOptions : CloudOptions {
  std::filesystem::path object, to, pose, pose_out;
  std::vector<double> up;
};
int cloud_align(const CloudAlignOptions& options);

struct CloudMeshOptions : CloudOptions, NormalOptions {
  std::string method = "poisson";
  int depth = 8;
  double trim_m = 0.010, edge_m = 0.015;
};
int cloud_mesh(const CloudMeshOptions& options);

struct CloudMergeOptions {
  std::vector<std::filesystem::path> inputs;  ///< clouds or sessions
  std::filesystem::path out, object;
  std::string method = "laser";
  std::vector<double> up;
  double least_share = 0.3;
  bool search = false, ascii = false, json = false;
};
int cloud_merge(const CloudMergeOptions& options);

/// Errors: InputError if `out` exists or lies in a session.
void check_new_file(const std::filesystem::path& out);

/// Where `up` points in the frame of `cloud`, which `file` holds, as given or known.
/// Errors: InputError if neither.
Vector3d up_of(const std::filesystem::path& file, const PointCloud& cloud, const std::vector<double>& given);

/// The cloud itself if all its points have normals; otherwise with normals, for which the camera must be known.
/// Errors: InputError if it is not, or no point has neighbours.
PointCloud given_or_made_normals(const std::filesystem::path& file, const PointCloud& cloud,
                                 const NormalOptions& options);

}  // namespace tankrig::app
