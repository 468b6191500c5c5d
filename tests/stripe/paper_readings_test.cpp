// Where the paper's words are silent: what the readings we did not take would do. Prints the table of
// docs/reference/paper_detector.md.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "reconstruction/stripe/paper_stripe.hpp"
#include "tests/stripe/generated_stripe.hpp"

namespace tankrig {
namespace {

enum class Tie { kFirst, kMiddle, kLast };
enum class Masses { kAll, kGated };

struct Reading {
  const char* name;
  Tie tie;
  Masses masses;
};

constexpr std::array kReadings{
    Reading{"first, all (ours)", Tie::kFirst, Masses::kAll}, Reading{"middle, all", Tie::kMiddle, Masses::kAll},
    Reading{"last, all", Tie::kLast, Masses::kAll},          Reading{"first, gated", Tie::kFirst, Masses::kGated},
    Reading{"middle, gated", Tie::kMiddle, Masses::kGated},
};

int intensity(const cv::Vec3b& pixel) { return pixel[0] + pixel[1] + pixel[2]; }

/// Row of the stripe in column `x`.
std::optional<double> read_column(const cv::Mat& bgr, const cv::Mat& gate, int x, const Reading& reading) {
  constexpr int kHalfWindow = 5;
  std::vector<int> best;
  for (int y = 0; y < bgr.rows; ++y) {
    if (!gate.at<std::uint8_t>(y, x)) continue;
    const int found = intensity(bgr.at<cv::Vec3b>(y, x));
    const int most = best.empty() ? -1 : intensity(bgr.at<cv::Vec3b>(best.front(), x));
    if (found > most) best.clear();
    if (found >= most) best.push_back(y);
  }
  if (best.empty()) return std::nullopt;
  const int peak = reading.tie == Tie::kFirst  ? best.front()
                   : reading.tie == Tie::kLast ? best.back()
                                               : best[best.size() / 2];
  double mass = 0, moment = 0;
  for (int y = std::max(0, peak - kHalfWindow); y <= std::min(bgr.rows - 1, peak + kHalfWindow); ++y) {
    if (reading.masses == Masses::kGated && !gate.at<std::uint8_t>(y, x)) continue;
    const double m = intensity(bgr.at<cv::Vec3b>(y, x));
    mass += m, moment += m * (y - peak);
  }
  return peak + moment / mass;
}

struct Effect {
  double bias = 0, rms = 0;  ///< [px]
  int columns = 0;
};

/// `as_detector`: what it finds is exactly what detect_paper() finds.
Effect effect_on(const GeneratedStripe& stripe, const PaperStripeParameters& parameters, const Reading& reading,
                 bool as_detector) {
  const cv::Mat image = stripe.image();
  cv::Mat hsv, gate;
  cv::cvtColor(image, hsv, cv::COLOR_BGR2HSV);
  cv::inRange(hsv, cv::Scalar(parameters.hue_min, parameters.saturation_min, parameters.value_min),
              cv::Scalar(parameters.hue_max, parameters.saturation_max, parameters.value_max), gate);
  const StripeDetection detection = detect_paper(image, parameters);
  Effect effect;
  for (int x = 0; x < image.cols; ++x) {
    const std::optional<double> row = read_column(image, gate, x, reading);
    if (!row) continue;
    if (as_detector) {
      const std::size_t i = static_cast<std::size_t>(effect.columns);
      EXPECT_LT(i, detection.peaks.size());
      if (i < detection.peaks.size()) {
        EXPECT_FLOAT_EQ(detection.peaks[i].position, static_cast<float>(*row));
      }
    }
    const double error = *row - stripe.true_row(x);
    effect.bias += error, effect.rms += error * error;
    ++effect.columns;
  }
  if (as_detector) {
    EXPECT_EQ(detection.peaks.size(), static_cast<std::size_t>(effect.columns));
  }
  effect.bias /= effect.columns;
  effect.rms = std::sqrt(effect.rms / effect.columns);
  return effect;
}

TEST(PaperReadings, DifferWhereAStripeIsClippedAndWhereTheSceneIsLit) {
  PaperStripeParameters parameters = PaperStripeParameters::simulation();
  parameters.orientation = StripeOrientation::kColumns;
  const Eigen::Vector3d pure_green(0, 1, 0), green(0.1, 1, 0.2);
  const auto stripe = [](double peak, const Eigen::Vector3d& bgr, double room) {
    GeneratedStripe made;
    made.width = 480;
    made.peak = peak, made.bgr = bgr, made.noise = 1;
    made.scene = [room](int, int) { return room; };
    return made;
  };
  const std::pair<const char*, GeneratedStripe> sets[] = {
      {"dark, not clipped", stripe(180, green, 8)},       {"dark, clipped", stripe(700, pure_green, 0)},
      {"dark, clipped far", stripe(5000, pure_green, 0)}, {"lit, not clipped", stripe(120, green, 60)},
      {"lit, clipped", stripe(700, pure_green, 60)},
  };
  std::printf("noise 1 DN, seed %u; bias and rms error [px]\n%-18s", sets[0].second.seed, "");
  for (const Reading& reading : kReadings) std::printf(" | %-17s", reading.name);
  std::printf("\n");
  std::array<std::array<Effect, kReadings.size()>, std::size(sets)> all;
  for (std::size_t s = 0; s < std::size(sets); ++s) {
    std::printf("%-18s", sets[s].first);
    for (std::size_t r = 0; r < kReadings.size(); ++r) {
      all[s][r] = effect_on(sets[s].second, parameters, kReadings[r], r == 0);
      EXPECT_EQ(all[s][r].columns, all[s][0].columns) << "the reading moves points, it finds no others";
      std::printf(" | %+7.3f   %7.3f", all[s][r].bias, all[s][r].rms);
    }
    std::printf("\n");
  }
  // Ties: first and last are biased to either side of the middle, where there are any.
  EXPECT_NEAR(all[0][0].rms, all[0][1].rms, 0.01);
  for (const std::size_t clipped : {1, 2}) {
    EXPECT_LT(all[clipped][0].bias, all[clipped][1].bias);
    EXPECT_GT(all[clipped][2].bias, all[clipped][1].bias);
  }
  // Masses: of a lit scene, the discarded pixels hold back a point that a tie has put off; without ties they help.
  EXPECT_LT(all[4][3].rms, all[4][0].rms - 0.1);
  EXPECT_GT(all[3][3].rms, all[3][0].rms + 0.05);
}

}  // namespace
}  // namespace tankrig
