// A laser method whose geometry, filters and files are PCL's, for <algorithm>: pcl_laser_cloud SESSION CLOUD.ply
// Pictures are read by VTK, as PCL reads its own.
#include <pcl/common/transforms.h>
#include <pcl/conversions.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <numeric>
#include <pcl/surface/impl/organized_fast_mesh.hpp>
#include <set>

#include "examples/algorithms/session_input.hpp"

namespace {

using Point = pcl::PointXYZL;  // its label is the frame
using Cloud = pcl::PointCloud<Point>;

constexpr int kHalf = 4;          // rows on either side of the brightest one
constexpr double kLeast = 60;     // grey levels, all colours together, that a peak stands above the dark frames
constexpr float kGap_m = 0.008F;  // neighbours farther apart are on different surfaces

/// Grey levels of all colours together, row by row from the top.
std::vector<float> read_picture(const std::string& file, const Camera& camera) {
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  vtkImageData* const image = reader->GetOutput();
  int size[3];
  image->GetDimensions(size);
  if (size[0] != camera.width || size[1] != camera.height)
    throw std::runtime_error(file + ": expected a picture of the camera's size");
  if (image->GetScalarType() != VTK_UNSIGNED_CHAR) throw std::runtime_error(file + ": expected 8 bits a colour");
  const auto* grey = static_cast<const unsigned char*>(image->GetScalarPointer());
  const int colours = image->GetNumberOfScalarComponents();
  std::vector<float> out;
  for (int v = size[1] - 1; v >= 0; --v)  // VTK's first row is the lowest
    for (int u = 0; u < size[0]; ++u) {
      const unsigned char* const pixel = grey + (v * size[0] + u) * colours;
      out.push_back(std::accumulate(pixel, pixel + colours, 0.F));
    }
  return out;
}

std::vector<float> mean_picture(const std::string& session, const Camera& camera) {
  std::vector<float> mean(static_cast<std::size_t>(camera.width * camera.height));
  const std::vector<FrameRow> frames = read_frames(session, camera.name, false);
  for (const FrameRow& frame : frames) {
    const std::vector<float> picture = read_picture(session + "/" + frame.at("file"), camera);
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += picture[i] / static_cast<float>(frames.size());
  }
  return mean;
}

/// Row of the stripe in a column; NaN where it shows none.
double stripe_row(const std::vector<float>& picture, const std::vector<float>& dark, const Camera& camera, int column) {
  const auto light = [&](int row) {
    const auto i = static_cast<std::size_t>(row * camera.width + column);
    return std::max(0.F, picture[i] - dark[i]);
  };
  int peak = kHalf;
  for (int row = kHalf; row < camera.height - kHalf; ++row)
    if (light(row) > light(peak)) peak = row;
  if (light(peak) < kLeast) return std::nan("");
  double sum = 0, moment = 0;
  for (int row = peak - kHalf; row <= peak + kHalf; ++row) sum += light(row), moment += light(row) * row;
  return moment / sum;
}

/// Direction of a pixel's ray, its distortion undone by iteration.
Eigen::Vector3d ray(const Camera& c, double column, double row) {
  const double xd = (column - c.cx) / c.fx, yd = (row - c.cy) / c.fy;
  double x = xd, y = yd;
  for (int i = 0; i < 20; ++i) {
    const double r2 = x * x + y * y, radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
    const double dx = 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x), dy = c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y;
    x = (xd - dx) / radial, y = (yd - dy) / radial;
  }
  return {x, y, 1};
}

/// A row for each frame of the sweep, a column for each of the picture's; NaN where there is no stripe. In b.
Cloud::Ptr organized_cloud(const std::string& session) {
  const Camera camera = read_camera(session, "mono");
  const std::vector<float> dark = mean_picture(session, camera);
  const std::vector<FrameRow> frames = read_frames(session, camera.name, true);
  Cloud seen(static_cast<std::uint32_t>(camera.width), static_cast<std::uint32_t>(frames.size()));
  seen.is_dense = false;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Eigen::Vector3d normal(number(frames[i], "plane_a"), number(frames[i], "plane_b"),
                                 number(frames[i], "plane_c"));
    const Eigen::Hyperplane<double, 3> laser(normal, number(frames[i], "plane_d_m"));
    const std::vector<float> picture = read_picture(session + "/" + frames[i].at("file"), camera);
    for (int u = 0; u < camera.width; ++u) {
      Point& point = seen.at(u, static_cast<int>(i));
      point.label = static_cast<std::uint32_t>(number(frames[i], "index"));
      point.getVector3fMap().setConstant(std::numeric_limits<float>::quiet_NaN());
      const double v = stripe_row(picture, dark, camera, u);
      if (std::isnan(v)) continue;
      const Eigen::ParametrizedLine<double, 3> sight(Eigen::Vector3d::Zero(), ray(camera, u, v));
      const double depth = sight.intersectionParameter(laser);
      if (depth > 0 && depth < 20) point.getVector3fMap() = sight.pointAt(depth).cast<float>();
    }
  }
  const auto cloud = pcl::make_shared<Cloud>();
  pcl::transformPointCloud(seen, *cloud, camera.bMc.matrix().cast<float>().eval());
  return cloud;
}

/// What belongs to a triangle between neighbouring rows and columns, so that lonely points go.
Cloud::Ptr on_surfaces(const Cloud::Ptr& cloud) {
  pcl::OrganizedFastMesh<Point> mesh;
  mesh.setTriangulationType(pcl::OrganizedFastMesh<Point>::TRIANGLE_ADAPTIVE_CUT);
  mesh.setMaxEdgeLength(kGap_m);
  mesh.storeShadowedFaces(true);
  mesh.setInputCloud(cloud);
  std::vector<pcl::Vertices> triangles;
  mesh.reconstruct(triangles);
  std::set<pcl::index_t> held;
  for (const pcl::Vertices& triangle : triangles) held.insert(triangle.vertices.begin(), triangle.vertices.end());
  return pcl::make_shared<Cloud>(*cloud, pcl::Indices(held.begin(), held.end()));
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "usage: pcl_laser_cloud SESSION CLOUD.ply\n"), 2;
  pcl::StatisticalOutlierRemoval<Point> filter;
  filter.setInputCloud(on_surfaces(organized_cloud(argv[1])));
  filter.setMeanK(12);
  filter.setStddevMulThresh(3);
  Cloud kept;
  filter.filter(kept);
  pcl::PCLPointCloud2 file;
  pcl::toPCLPointCloud2(kept, file);
  for (pcl::PCLPointField& field : file.fields)
    if (field.name == "label") field.name = "frame";
  if (pcl::PLYWriter().write(argv[2], file, Eigen::Vector4f::Zero(), Eigen::Quaternionf::Identity(), true, false) != 0)
    throw std::runtime_error(std::string(argv[2]) + ": cannot be written");
} catch (const std::exception& e) {
  return std::fprintf(stderr, "pcl_laser_cloud: %s\n", e.what()), 1;
}
