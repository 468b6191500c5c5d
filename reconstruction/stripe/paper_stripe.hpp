// The paper's stripe detector (section VI-B): HSV gate, brightest pixel of each column, centre of masses around it.
#pragma once

#include <string>

#include "core/config_node.hpp"
#include "reconstruction/stripe/stripe.hpp"

namespace tankrig {

/// Thresholds in OpenCV's 8-bit HSV (hue 0..179, saturation and value 0..255), both ends included.
struct PaperStripeParameters {
  int hue_min = 15, hue_max = 91;
  int saturation_min = 0, saturation_max = 90;
  int value_min = 181, value_max = 255;
  int half_window = 5;  ///< pixels on either side of the brightest that enter the centre of masses
  StripeOrientation orientation = StripeOrientation::kAuto;  ///< kAuto: as our own detector finds it
  bool blur = false;        ///< the laboratory's public code: Gauss 5x5, sigma 10 px, before the gate
  bool morphology = false;  ///< the laboratory's public code: open and close the gate with a 5x5 ellipse

  /// Values the laboratory published for its camera in the tank.
  static PaperStripeParameters real() { return {}; }
  /// Values the laboratory published for the simulator.
  static PaperStripeParameters simulation();
};

/// "hue 15 to 91, saturation 0 to 90, value 181 to 255".
std::string gate_in_words(const PaperStripeParameters& parameters);

/// Intensity is (R + G + B) / 3 of the unblurred image. No background is removed: the paper's detector has none.
/// sigma_px is 0 (unknown). Where the paper's words are silent (docs/reference/paper_detector.md has what the other
/// readings do):
///  * "the pixel with the highest intensity is selected": among equals, as the pixels of a clipped stripe are, the first
///  from the top (from the left, for kRows);
///  * "the center of masses algorithm is applied to this pixel and the five pixels above and below it": to all of them,
///  also to those that the gate discarded, with R + G + B as their masses.
/// `image`: 8-bit, 1 or 3 (BGR) channels; grey counts as hue 0, saturation 0.
/// Errors: InputError for another type.
StripeDetection detect_paper(const cv::Mat& image, const PaperStripeParameters& parameters);

/// The rig file's `reconstruction: laser_paper:`.
extern const SettingsTable<PaperStripeParameters> kPaperStripeKeys;

}  // namespace tankrig
