// Our distances to a mesh beside another library's: VTK's.
#include <gtest/gtest.h>
#include <vtkCellArray.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticCellLocator.h>

#include <random>

#include "bench/metrics/mesh_distance.hpp"
#include "tests/metrics/shapes.hpp"

namespace tankrig {
namespace {

class VtkDistance {
 public:
  explicit VtkDistance(const TriangleMesh& mesh) {
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (const Vector3d& v : mesh.vertices) points->InsertNextPoint(v.data());
    vtkNew<vtkCellArray> triangles;
    for (const Eigen::Vector3i& t : mesh.triangles) triangles->InsertNextCell({t[0], t[1], t[2]});
    surface_->SetPoints(points);
    surface_->SetPolys(triangles);
    locator_->SetDataSet(surface_);
    locator_->BuildLocator();
  }
  double at(const Vector3d& p) {
    double nearest[3], squared = 0;
    vtkIdType cell = 0;
    int part = 0;
    vtkNew<vtkGenericCell> generic;
    locator_->FindClosestPoint(p.data(), nearest, generic, cell, part, squared);
    return std::sqrt(squared);
  }

 private:
  vtkNew<vtkPolyData> surface_;
  vtkNew<vtkStaticCellLocator> locator_;
};

TEST(MeshDistance, AgreesWithAnotherLibrarysToTenMicrometres) {
  constexpr unsigned kSeed = 5;
  RecordProperty("seed", kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> coordinate(-0.3, 0.3);
  TriangleMesh bumpy = shapes::icosphere(0.1, 4);
  for (Vector3d& v : bumpy.vertices) v *= 1 + 0.25 * std::sin(60 * v.x()) * std::cos(45 * v.y() + 30 * v.z());
  for (const TriangleMesh& mesh :
       {shapes::tank_box(), bumpy, read_mesh(TANKRIG_SOURCE_DIR "/etc/objects/black_box.obj")}) {
    const MeshDistance ours(mesh);
    VtkDistance theirs(mesh);
    for (int i = 0; i < 2000; ++i) {
      const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
      EXPECT_NEAR(ours.at(p).distance, theirs.at(p), 1e-5) << "seed " << kSeed << " point " << i;
    }
  }
}

}  // namespace
}  // namespace tankrig
