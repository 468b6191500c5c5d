// The colour of the light in one section across the stripe, and what it says of another line beside it.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "reconstruction/stripe/find/appearance.hpp"
#include "reconstruction/stripe/find/stripe_path.hpp"
#include "reconstruction/stripe/stripe_parameters.hpp"

namespace tankrig {

/// Of a section across the stripe, or of several: light above what lies beside it, per channel, where not clipped.
struct SectionColour {
  Eigen::Vector3d light = Eigen::Vector3d::Zero();
  double variance = 0;  ///< of each channel
  bool hidden = false;  ///< of a core wider than the section: it has none

  SectionColour& operator+=(const SectionColour& other) {
    light += other.light;
    variance += other.variance;
    return *this;
  }
};

/// Whether `light` is off the direction `stripe`, of unit length, by more than `tolerance` and more than the camera's
/// response may turn it.
bool is_another_colour(const Eigen::Vector3d& light, double tolerance, const Eigen::Vector3d& stripe);

/// Of one image whose stripe crosses the columns.
class SectionColours {
 public:
  /// Views of what is given. `reach`: rows to either side of a point that are its section's.
  SectionColours(const cv::Mat& image, const cv::Mat& background, const StripeAppearance& appearance, int reach)
      : image_(image), background_(background), appearance_(appearance), reach_(reach) {}

  /// Of the pixels that are not clipped, above the mean of two pixels on either side beyond the profile; 0 in a grey image,
  /// where the image ends first, and across an edge of the scene's brightness.
  SectionColour at(int column, double row) const;

  /// Another line in the point's column, almost as strong and continued on both sides. The laser's light has one colour
  /// wherever it falls: beside a point of that colour a line of another is no rival.
  bool has_rival(const RidgeCandidates& candidates, const PathPoint& point, const StripeParameters& parameters) const;

 private:
  struct Line {
    int columns = 0;  ///< beside its own
    SectionColour colour;
  };
  struct Brightest {
    double light = 0;  ///< under the stripe's colour, with the scene's
    bool clips = false;
  };
  Brightest brightest_at(int column, double row) const;
  Line line_at(const RidgeCandidates& candidates, int middle, double row, double max_step_px) const;
  bool differs(const SectionColour& colour) const;

  const cv::Mat &image_, &background_;
  const StripeAppearance& appearance_;
  int reach_;
};

}  // namespace tankrig
