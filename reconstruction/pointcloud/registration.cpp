#include "reconstruction/pointcloud/registration.hpp"

#include <pcl/registration/correspondence_rejection_surface_normal.h>
#include <pcl/registration/icp.h>
#include <pcl/search/kdtree.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/input_error.hpp"
#include "reconstruction/pointcloud/cloud_filters.hpp"
#include "reconstruction/pointcloud/pcl_conversion.hpp"

namespace tankrig {
namespace {

using SurfaceCloud = pcl::PointCloud<pcl::PointNormal>;
constexpr std::size_t kLeastPairs = 6;
constexpr double kNormalsAgree = std::numbers::sqrt2 / 2;  ///< cosine of the largest angle between partners' normals

/// The surface, ready for many registrations. Everything is centred, because PCL rounds to single precision.
class Surface {
 public:
  explicit Surface(const PointCloud& surface) {
    for (const CloudPoint& point : surface.points) centre_ += point.p / static_cast<double>(surface.points.size());
    points_ = to_pcl<pcl::PointNormal>(transformed(to_centre(), surface, surface.frame));
    tree_ = std::make_shared<pcl::search::KdTree<pcl::PointNormal>>();
    tree_->setInputCloud(points_);
  }

  Transform to_centre() const { return Transform(Eigen::Translation3d(-centre_)); }
  const SurfaceCloud::Ptr& points() const { return points_; }
  const pcl::search::KdTree<pcl::PointNormal>::Ptr& tree() const { return tree_; }

 private:
  Vector3d centre_ = Vector3d::Zero();
  SurfaceCloud::Ptr points_;
  pcl::search::KdTree<pcl::PointNormal>::Ptr tree_;
};

/// What pairs say of a small motion: their distances along the surface's normals, linear in the rotation about the pairs'
/// centre, in units of their mean square radius, and in the translation.
struct PairSums {
  Vector3d centre = Vector3d::Zero();
  double radius = 0;
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();  ///< mean of J' J
  Eigen::Matrix<double, 6, 1> pull = Eigen::Matrix<double, 6, 1>::Zero();         ///< mean of J' distance
  double rms = 0;

  PairSums(const std::vector<Vector3d>& moved, const std::vector<Vector3d>& partners,
           const std::vector<Vector3d>& normals) {
    const double count = static_cast<double>(moved.size());
    for (const Vector3d& p : moved) centre += p / count;
    for (const Vector3d& p : moved) radius += (p - centre).squaredNorm() / count;
    radius = std::sqrt(radius);
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const double distance = normals[i].dot(partners[i] - moved[i]);
      Eigen::Matrix<double, 6, 1> j;
      j << (moved[i] - centre).cross(normals[i]) / radius, normals[i];
      information += j * j.transpose() / count;
      pull += j * distance / count;
      rms += distance * distance / count;
    }
    rms = std::sqrt(rms);
  }
};

/// PCL's own point-to-plane step inverts a matrix that a plane or a sphere makes singular, and goes on with what is no
/// number. This one leaves what is not held where it is.
class DampedStep final
    : public pcl::registration::TransformationEstimation<pcl::PointNormal, pcl::PointNormal, double> {
  using Points = pcl::ConstCloudIterator<pcl::PointNormal>;

 public:
  void estimateRigidTransformation(const SurfaceCloud& b, const SurfaceCloud& a, Matrix4& aMb) const override {
    solve(Points(b), Points(a), aMb);
  }
  void estimateRigidTransformation(const SurfaceCloud& b, const pcl::Indices& of_b, const SurfaceCloud& a,
                                   Matrix4& aMb) const override {
    solve(Points(b, of_b), Points(a), aMb);
  }
  void estimateRigidTransformation(const SurfaceCloud& b, const pcl::Indices& of_b, const SurfaceCloud& a,
                                   const pcl::Indices& of_a, Matrix4& aMb) const override {
    solve(Points(b, of_b), Points(a, of_a), aMb);
  }
  void estimateRigidTransformation(const SurfaceCloud& b, const SurfaceCloud& a, const pcl::Correspondences& pairs,
                                   Matrix4& aMb) const override {
    solve(Points(b, pairs, true), Points(a, pairs, false), aMb);
  }

 private:
  static void solve(Points b, Points a, Matrix4& aMb) {
    std::vector<Vector3d> moved, partners, normals;
    for (; b.isValid() && a.isValid(); ++b, ++a) {
      moved.push_back(b->getVector3fMap().cast<double>());
      partners.push_back(a->getVector3fMap().cast<double>());
      normals.push_back(a->getNormalVector3fMap().cast<double>());
    }
    const PairSums sums(moved, partners, normals);
    constexpr double kDamping = 1e-3;
    const Eigen::Matrix<double, 6, 6> damped = sums.information + kDamping * Eigen::Matrix<double, 6, 6>::Identity();
    const Eigen::Matrix<double, 6, 1> motion = damped.ldlt().solve(sums.pull);
    const Vector3d turn = motion.head<3>() / sums.radius, shift = motion.tail<3>();
    const Eigen::AngleAxisd rotation(turn.norm(), turn.norm() > 0 ? turn.normalized() : Vector3d::UnitX());
    aMb = (Eigen::Translation3d(sums.centre + shift) * rotation * Eigen::Translation3d(-sums.centre)).matrix();
  }
};

Eigen::Matrix4d icp_step(const Surface& surface, const SurfaceCloud::Ptr& moved, bool normals, double reach,
                         int iterations, const Eigen::Matrix4d& start) {
  pcl::IterativeClosestPoint<pcl::PointNormal, pcl::PointNormal, double> icp;
  icp.setTransformationEstimation(std::make_shared<DampedStep>());
  icp.setInputTarget(surface.points());
  icp.setSearchMethodTarget(surface.tree(), true);
  icp.setInputSource(moved);
  icp.setMaxCorrespondenceDistance(reach);
  icp.setMaximumIterations(iterations);
  icp.setTransformationEpsilon(1e-12);
  icp.setEuclideanFitnessEpsilon(1e-12);
  if (normals) {
    const auto rejector = std::make_shared<pcl::registration::CorrespondenceRejectorSurfaceNormal>();
    rejector->setThreshold(kNormalsAgree);
    icp.addCorrespondenceRejector(rejector);
  }
  SurfaceCloud ignored;
  icp.align(ignored, start);
  return icp.getFinalTransformation();
}

/// Fills in what the pairs say of the pose in registration.aMb, which is in the centred frame here.
void judge_pairs(const Surface& surface, const SurfaceCloud& moved, bool normals, double reach, Registration& r) {
  std::vector<Vector3d> places, partners, directions;
  std::vector<int> nearest(1);
  std::vector<float> squared(1);
  for (const pcl::PointNormal& point : moved) {
    const Vector3d p = r.aMb * point.getVector3fMap().cast<double>();
    pcl::PointNormal query;
    query.getVector3fMap() = p.cast<float>();
    if (surface.tree()->nearestKSearch(query, 1, nearest, squared) == 0 || squared[0] > reach * reach) continue;
    const pcl::PointNormal& partner = (*surface.points())[static_cast<std::size_t>(nearest[0])];
    const Vector3d n = partner.getNormalVector3fMap().cast<double>();
    if (normals && n.dot(r.aMb.linear() * point.getNormalVector3fMap().cast<double>()) < kNormalsAgree) continue;
    places.push_back(p);
    partners.push_back(partner.getVector3fMap().cast<double>());
    directions.push_back(n);
  }
  r.pairs = places.size();
  constexpr double kClose = 1.0 / 6;
  std::size_t close = 0;
  double fits = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double part = directions[i].dot(partners[i] - places[i]) / (kClose * reach);
    close += std::abs(part) <= 1;
    fits += std::max(0.0, 1 - part * part);
  }
  r.share = static_cast<double>(close) / static_cast<double>(std::max<std::size_t>(moved.size(), 1));
  r.fit = fits / static_cast<double>(std::max<std::size_t>(moved.size(), 1));
  r.free = 6;
  if (r.pairs < kLeastPairs) return;
  const PairSums sums(places, partners, directions);
  r.rms_m = sums.rms;
  const Eigen::Matrix<double, 6, 1> held =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(sums.information, Eigen::EigenvaluesOnly)
          .eigenvalues();
  r.firmness = std::max(held[0], 0.0);
  r.free = static_cast<int>((held.array() < kLeastFirmness).count());
}

}  // namespace

Registration register_cloud(const PointCloud& surface_a, const PointCloud& cloud_b, const Transform& aMb_start,
                            const RegistrationSettings& settings) {
  const QuietPcl quiet;
  if (!surface_a.has_normals()) throw InputError("registration: the surface has no normals");
  const Surface surface(surface_a);
  const PointCloud thin = thinned(cloud_b, settings.spacing_m);
  Vector3d middle = Vector3d::Zero();
  for (const CloudPoint& point : thin.points) middle += point.p / static_cast<double>(thin.points.size());
  const Transform mMb(Eigen::Translation3d(-middle));
  const auto moved = to_pcl<pcl::PointNormal>(transformed(mMb, thin, thin.frame));
  const bool normals = thin.has_normals();

  Registration r;
  r.aMb = surface.to_centre() * aMb_start * mMb.inverse();
  for (double reach = settings.first_reach_m;; reach = std::max(reach / 2, settings.reach_m)) {
    judge_pairs(surface, *moved, normals, reach, r);
    if (r.pairs < kLeastPairs) break;
    const int iterations = reach > settings.reach_m ? 10 : 30;
    r.aMb.matrix() = icp_step(surface, moved, normals, reach, iterations, r.aMb.matrix());
    r.aMb.linear() = Eigen::Quaterniond(r.aMb.linear()).normalized().toRotationMatrix();
    if (reach <= settings.reach_m) break;
  }
  judge_pairs(surface, *moved, normals, settings.reach_m, r);
  r.aMb = surface.to_centre().inverse() * r.aMb * mMb;
  return r;
}

std::string doubt(const Registration& r, double least_share) {
  char text[200] = "";
  if (r.share < least_share)
    std::snprintf(text, sizeof text,
                  "too little overlap: %.0f %% of the points lie on the other surface, expected %.0f %%", 100 * r.share,
                  100 * least_share);
  else if (r.free > 0)
    std::snprintf(text, sizeof text,
                  "the shape leaves %d of the 6 freedoms open (firmness %.3f, expected %.2f): what overlaps slides or "
                  "turns on itself",
                  r.free, r.firmness, kLeastFirmness);
  return text;
}

double rotation_angle(const Transform& aMb) { return std::abs(Eigen::AngleAxisd(aMb.linear()).angle()); }

}  // namespace tankrig
