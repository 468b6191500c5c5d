// The stripe in each frame of a sweep as it comes: what an operator sees, and what a growing cloud is made of.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/frame_record.hpp"
#include "pipeline/parameters.hpp"
#include "reconstruction/stripe/stripe_reconstruction.hpp"

namespace tankrig {

/// One frame of the sweep.
struct LiveLine {
  int frame = 0;                   ///< FrameRecord::index
  Stamp stamp{};                   ///< FrameRecord::stamp
  std::uint64_t columns = 0;       ///< searched (rows, for a stripe along columns)
  std::uint64_t found = 0;         ///< of those, with a stripe
  std::uint64_t clipped = 0;       ///< of those, as bright as the camera can tell
  std::vector<CloudPoint> points;  ///< in b, inside the workspace; particles are still among them
};

/// Our detector with what is known by then: the dark images so far, and the stripe's look in the first lit frames. The
/// session's reconstruction has all of them, so its points differ a little.
/// Threads: one.
class LiveDetector {
 public:
  LiveDetector(const CalibratedCamera& camera, const PipelineParameters& parameters);

  void add_dark(const cv::Mat& image);
  /// While there is time: what is made of the dark images so far. find_line() makes what is not there yet.
  void learn_dark();
  /// Errors: InputError if the image is not of the camera's size.
  LiveLine find_line(const cv::Mat& image, const FrameRecord& frame, const Plane& cPl);

 private:
  void learn(const cv::Mat& image);

  CalibratedCamera camera_;
  StripeParameters detector_;
  StripeReconstructionParameters job_;
  std::vector<cv::Mat> dark_;
  cv::Mat background_;
  int looks_ = 0;
  StripeLook look_;
  ContrastScatters scatters_;
};

}  // namespace tankrig
