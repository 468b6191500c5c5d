// Stereo by OpenCV alone, for <algorithm>: mean of the pairs, rectification, semi-global block matching.
// sgbm_cloud SESSION CLOUD.ply
#include <cstdio>
#include <exception>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "examples/algorithms/session_input.hpp"

namespace {

cv::Mat matrix(const Camera& eye) { return (cv::Mat_<double>(3, 3) << eye.fx, 0, eye.cx, 0, eye.fy, eye.cy, 0, 0, 1); }

cv::Mat distortion(const Camera& eye) { return (cv::Mat_<double>(1, 5) << eye.k1, eye.k2, eye.p1, eye.p2, eye.k3); }

/// The scene is at rest: their mean has less noise.
cv::Mat mean_picture(const std::string& session, const Camera& eye) {
  const std::vector<FrameRow> frames = read_frames(session, eye.name, false);
  cv::Mat sum = cv::Mat::zeros(eye.height, eye.width, CV_32F);
  for (const FrameRow& frame : frames) {
    const std::string file = session + "/" + frame.at("file");
    const cv::Mat picture = cv::imread(file, cv::IMREAD_GRAYSCALE);
    if (picture.size() != sum.size()) throw std::runtime_error(file + ": expected a picture of the camera's size");
    cv::accumulate(picture, sum);
  }
  cv::Mat mean;
  sum.convertTo(mean, CV_8U, 1.0 / static_cast<double>(frames.size()));
  return mean;
}

cv::Mat rectified(const std::string& session, const Camera& eye, const cv::Mat& R, const cv::Mat& P) {
  cv::Mat map1, map2, out;
  cv::initUndistortRectifyMap(matrix(eye), distortion(eye), R, P, {eye.width, eye.height}, CV_32FC1, map1, map2);
  cv::remap(mean_picture(session, eye), out, map1, map2, cv::INTER_LINEAR);
  return out;
}

/// Binary PLY of float32 x y z, in the arm's base b.
void write_ply(const std::string& file, const std::vector<Eigen::Vector3f>& points) {
  std::ofstream out(file, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\ncomment frame b\nelement vertex " << points.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (const Eigen::Vector3f& p : points) out.write(reinterpret_cast<const char*>(p.data()), 3 * sizeof(float));
  if (!out.flush()) throw std::runtime_error(file + ": cannot be written");
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "usage: sgbm_cloud SESSION CLOUD.ply\n"), 2;
  const std::string session = argv[1];
  const Camera left = read_camera(session, "left"), right = read_camera(session, "right");
  const Eigen::Isometry3d rMl = right.bMc.inverse() * left.bMc;
  cv::Mat rotation(3, 3, CV_64F), translation(3, 1, CV_64F), R1, R2, P1, P2, Q;
  for (int i = 0; i < 3; ++i) {
    translation.at<double>(i) = rMl.translation()[i];
    for (int j = 0; j < 3; ++j) rotation.at<double>(i, j) = rMl.linear()(i, j);
  }
  cv::stereoRectify(matrix(left), distortion(left), matrix(right), distortion(right), {left.width, left.height},
                    rotation, translation, R1, R2, P1, P2, Q, cv::CALIB_ZERO_DISPARITY, 0);
  constexpr int kBlock = 5, kDisparities = 128;
  const auto matcher = cv::StereoSGBM::create(0, kDisparities, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock, 1, 31,
                                              10, 100, 2, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat disparity16, disparity, places;
  matcher->compute(rectified(session, left, R1, P1), rectified(session, right, R2, P2), disparity16);
  disparity16.convertTo(disparity, CV_32F, 1.0 / int{cv::StereoMatcher::DISP_SCALE});
  cv::reprojectImageTo3D(disparity, places, Q);
  Eigen::Matrix3d R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R(i, j) = R1.at<double>(i, j);
  const Eigen::Matrix3d bRr = left.bMc.linear() * R.transpose();
  std::vector<Eigen::Vector3f> points;
  for (int v = 0; v < places.rows; ++v)
    for (int u = 0; u < places.cols; ++u) {
      const auto& p = places.at<cv::Vec3f>(v, u);
      if (disparity.at<float>(v, u) > 0 && p[2] < 20)
        points.emplace_back((bRr * Eigen::Vector3d(p[0], p[1], p[2]) + left.bMc.translation()).cast<float>());
    }
  write_ply(argv[2], points);
} catch (const std::exception& e) {
  return std::fprintf(stderr, "sgbm_cloud: %s\n", e.what()), 1;
}
