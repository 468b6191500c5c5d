#include "tests/stereo_bound/disparity_bound.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace tankrig::testing {
namespace {

constexpr float kFar = 1e3f;  // [m], where there is nothing

/// The derivative along the rows of what the pixels are samples of, no frequency left out: by Fourier's transform of each row
/// and its mirror image.
cv::Mat1f derivative(const cv::Mat1f& image) {
  cv::Mat1f mirror, wide;
  cv::flip(image, mirror, 1);
  cv::hconcat(image, mirror, wide);
  cv::Mat2f spectrum;
  cv::dft(wide, spectrum, cv::DFT_ROWS | cv::DFT_COMPLEX_OUTPUT);
  const int n = wide.cols;
  for (int v = 0; v < spectrum.rows; ++v)
    for (int k = 0; k < n; ++k) {
      const int cycles = 2 * k < n ? k : 2 * k > n ? k - n : 0;
      const auto w = static_cast<float>(2 * std::numbers::pi * cycles / n);
      const cv::Vec2f s = spectrum(v, k);
      spectrum(v, k) = {-w * s[1], w * s[0]};
    }
  cv::Mat1f slopes;
  cv::dft(spectrum, slopes, cv::DFT_ROWS | cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  return slopes.colRange(0, image.cols).clone();
}

cv::Mat3f derivative(const cv::Mat3f& image) {
  std::vector<cv::Mat1f> channels(3);
  cv::split(image, channels);
  for (cv::Mat1f& channel : channels) channel = derivative(channel);
  cv::Mat3f out;
  cv::merge(channels, out);
  return out;
}

/// Distance along the ray to the triangle; nothing if it passes beside.
std::optional<double> meets(const Vector3d& from, const Vector3d& ray, const TriangleMesh& mesh, std::size_t triangle) {
  const Eigen::Vector3i& t = mesh.triangles[triangle];
  const Vector3d a = mesh.vertices[static_cast<std::size_t>(t[0])];
  const Vector3d ab = mesh.vertices[static_cast<std::size_t>(t[1])] - a,
                 ac = mesh.vertices[static_cast<std::size_t>(t[2])] - a;
  const Vector3d p = ray.cross(ac);
  const double det = ab.dot(p);
  if (std::abs(det) < 1e-15) return std::nullopt;
  const Vector3d s = from - a, q = s.cross(ab);
  const double u = s.dot(p) / det, v = ray.dot(q) / det, far = ac.dot(q) / det;
  if (u < 0 || v < 0 || u + v > 1 || far <= 0) return std::nullopt;
  return far;
}

Vector3d normal_of(const TriangleMesh& mesh, std::size_t triangle) {
  const Eigen::Vector3i& t = mesh.triangles[triangle];
  const Vector3d a = mesh.vertices[static_cast<std::size_t>(t[0])];
  return (mesh.vertices[static_cast<std::size_t>(t[1])] - a)
      .cross(mesh.vertices[static_cast<std::size_t>(t[2])] - a)
      .normalized();
}

/// Triangles of one plane are one face: a number for each triangle.
std::vector<int> faces_of(const TriangleMesh& mesh, int& faces) {
  std::vector<Plane> planes;
  std::vector<int> out;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector3d n = normal_of(mesh, t);
    const double offset = -n.dot(mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][0])]);
    const auto known = std::ranges::find_if(planes, [&](const Plane& plane) {
      return (plane.normal - n).norm() < 1e-6 && std::abs(plane.offset - offset) < 1e-6;
    });
    out.push_back(static_cast<int>(known - planes.begin()));
    if (known == planes.end()) planes.push_back({n, offset});
  }
  faces = static_cast<int>(planes.size());
  return out;
}

}  // namespace

double censored_information(double z) {
  const double phi = std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi);
  const double below = 0.5 * std::erfc(z / std::numbers::sqrt2);  // share that is read as 0
  if (below < 1e-12) return 1;
  return std::clamp((1 - below) - z * phi + phi * phi / below, 0.0, 1.0);
}

DisparityBound::DisparityBound(const cv::Mat3b& clean, const Eyes& eyes, const ObjectSurface& object,
                               const MetricThresholds& thresholds)
    : eyes_(eyes), object_(object), face_(clean.size(), -1), metres_(clean.size(), 0.0f) {
  CeilingViews views;
  views.cameras = {eyes.left, eyes.right};
  views.max_incidence = thresholds.max_incidence;
  ceiling_ = surface_ceiling(object.mesh(), object.samples(), views);
  clean.convertTo(grey_, CV_32F);
  slope_ = derivative(grey_);

  const std::vector<int> faces = faces_of(object.mesh(), faces_);
  const Transform& oMc = eyes.left.oMc;
  for (int v = 0; v < clean.rows; ++v)
    for (int u = 0; u < clean.cols; ++u) {
      const Vector3d ray = eyes.left.camera.ray(u, v), o_ray = oMc.linear() * ray;
      double nearest = kFar;
      for (std::size_t t = 0; t < faces.size(); ++t) {
        const auto far = meets(oMc.translation(), o_ray, object.mesh(), t);
        if (!far || *far >= nearest) continue;
        nearest = *far;
        const double z = nearest * ray.z();
        face_(v, u) = faces[t];
        // A pixel of disparity is z^2 / (focal * baseline) of depth; the surface is hit aslant.
        metres_(v, u) = static_cast<float>(z * z / (eyes.focal_px * eyes.baseline) / ray.z() *
                                           std::abs(normal_of(object.mesh(), t).dot(o_ray)));
      }
    }
}

cv::Mat1f DisparityBound::errors(const Condition& condition) const {
  const double variance = condition.noise * condition.noise / condition.pairs;
  cv::Mat1f errors(face_.size(), kFar);
  for (int face = 0; face < faces_; ++face) {
    cv::Mat1d information(face_.size(), 0.0);
    for (int v = 0; v < face_.rows; ++v)
      for (int u = 0; u < face_.cols; ++u) {
        if (face_(v, u) != face) continue;
        for (int c = 0; c < 3; ++c) {
          const double slope = condition.light * slope_(v, u)[c];
          const double told = censored_information(condition.light * grey_(v, u)[c] / condition.noise);
          information(v, u) += slope * slope * told / (2 * variance);
        }
      }
    const int side = 2 * condition.radius_px + 1;
    cv::Mat1d sum;
    cv::boxFilter(information, sum, CV_64F, {side, side}, {-1, -1}, false, cv::BORDER_CONSTANT);
    for (int v = 0; v < face_.rows; ++v)
      for (int u = 0; u < face_.cols; ++u)
        if (face_(v, u) == face && sum(v, u) > 0)
          errors(v, u) = static_cast<float>(std::sqrt(2 / std::numbers::pi / sum(v, u)) * metres_(v, u));
  }
  return errors;
}

double DisparityBound::mean_error(const Condition& condition, double share) const {
  const Transform cMo = eyes_.left.oMc.inverse();
  std::vector<std::pair<Vector3d, float>> seen;  // in the left eye's frame, with its weight
  double nearest = kFar;
  for (std::size_t i = 0; i < object_.samples().size(); ++i) {
    if (!ceiling_.reachable[i]) continue;
    seen.emplace_back(cMo * object_.samples()[i].p, object_.samples()[i].weight);
    nearest = std::min(nearest, seen.back().first.z());
  }
  // For every place the best of the pixels that would cover it, and some beside.
  const int side = 2 * static_cast<int>(std::ceil(condition.spread_m * eyes_.focal_px / nearest)) + 1;
  cv::Mat1f least;
  cv::erode(errors(condition), least, cv::Mat::ones(side, side, CV_8U));
  std::vector<std::pair<float, float>> places;  // error, weight
  double whole = 0;
  for (const auto& [p, weight] : seen) {
    const auto pixel = eyes_.left.camera.project(p);
    if (!pixel || !eyes_.left.camera.contains(*pixel)) continue;
    places.emplace_back(least(static_cast<int>(std::lround(pixel->y())), static_cast<int>(std::lround(pixel->x()))),
                        weight);
    whole += weight;
  }
  std::ranges::sort(places);
  double sum = 0, covered = 0;
  for (const auto& [error, weight] : places) {
    if (covered >= share * whole) break;
    sum += static_cast<double>(error) * weight;
    covered += weight;
  }
  return covered > 0 ? sum / covered : 0;
}

}  // namespace tankrig::testing
