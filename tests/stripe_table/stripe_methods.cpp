#include "tests/stripe_table/stripe_methods.hpp"

#include <cmath>

#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "tests/stripe_table/stripe_peers.hpp"

namespace tankrig {
namespace {

FoundStripe found_of(const StripeDetection& detection, StripeOrientation orientation, std::size_t columns) {
  FoundStripe found;
  found.position.assign(columns, NAN);
  found.sigma.assign(columns, NAN);
  if (detection.orientation != orientation) return found;
  for (const StripePeak& peak : detection.peaks) {
    const auto x = static_cast<std::size_t>(peak.column);
    found.position[x] = peak.position;
    if (peak.sigma_px > 0) found.sigma[x] = peak.sigma_px;
  }
  return found;
}

FoundStripe found_of(std::vector<double> rows) {
  const std::size_t n = rows.size();
  return {std::move(rows), std::vector<double>(n, NAN)};
}

}  // namespace

std::array<FoundStripe, kMethods> detect_by_all(const cv::Mat& image, const cv::Mat& background,
                                                StripeOrientation orientation, int channel) {
  const bool rows = orientation == StripeOrientation::kRows;
  const auto columns = static_cast<std::size_t>(rows ? image.rows : image.cols);
  std::array<FoundStripe, kMethods> out;
  StripeParameters ours;
  out[kSmooth] = found_of(detect_stripe(image, background, ours), orientation, columns);
  ours.smoothing_px = 0;
  out[kRaw] = found_of(detect_stripe(image, background, ours), orientation, columns);
  PaperStripeParameters paper = PaperStripeParameters::simulation();
  paper.orientation = orientation;
  paper.hue_min = 0, paper.hue_max = 179;
  out[kPaper] = found_of(detect_paper(image, paper), orientation, columns);
  constexpr double kThreshold = 12;
  cv::Mat1f light = peer_light(image, background, channel);
  if (rows) light = light.t();
  out[kSteger] = found_of(steger_ridge(light, 2, kThreshold));
  out[kParabola] = found_of(log_parabola(light, kThreshold));
  out[kMass] = found_of(centre_of_mass(light, 5, kThreshold));
  return out;
}

}  // namespace tankrig
