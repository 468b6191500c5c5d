// The table of detectors: ours with and without smoothing, published peers and the paper's, over the scenes of the
// second generator. Prints Markdown, as docs/measured/stripe.md holds it.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "reconstruction/stripe/paper_stripe.hpp"
#include "reconstruction/stripe/stripe_detector.hpp"
#include "tests/stripe_table/stripe_peers.hpp"
#include "tests/stripe_table/stripe_scenes.hpp"

namespace tankrig {
namespace {

constexpr double kGross = 3;  ///< [px] beyond which a point is false

struct Score {
  double squares = 0, sum = 0, normalised = 0;
  int near = 0, gross = 0, there = 0, columns = 0, sigmas = 0;

  void add(double truth, double row, double sigma) {
    ++columns;
    there += std::isfinite(truth);
    if (!std::isfinite(row)) return;
    const double error = row - truth;
    if (!(std::abs(error) <= kGross)) {
      ++gross;
      return;
    }
    ++near;
    sum += error, squares += error * error;
    if (sigma > 0) normalised += error * error / (sigma * sigma), ++sigmas;
  }
  void print() const {
    if (near > 0)
      std::printf(" | %.3f / %+.3f / %.1f / %.1f", std::sqrt(squares / near), sum / near, 100.0 * near / there,
                  100.0 * gross / columns);
    else
      std::printf(" | - / - / %s / %.1f", there ? "0.0" : "-", 100.0 * gross / columns);
  }
};

void add_peaks(const StripeScene& scene, const StripeDetection& detection, Score& score) {
  std::vector<double> rows(scene.truth.size(), NAN), sigmas(rows);
  if (detection.orientation == StripeOrientation::kColumns)
    for (const StripePeak& peak : detection.peaks)
      rows[static_cast<std::size_t>(peak.column)] = peak.position,
      sigmas[static_cast<std::size_t>(peak.column)] = peak.sigma_px;
  for (std::size_t x = 0; x < rows.size(); ++x) score.add(scene.truth[x], rows[x], sigmas[x]);
}

void add_rows(const StripeScene& scene, const std::vector<double>& rows, Score& score) {
  for (std::size_t x = 0; x < rows.size(); ++x) score.add(scene.truth[x], rows[x], 0);
}

int laser_channel(const std::string& name) {
  for (const char* green : {"wide, 40", "speckle,", "board with", "JPEG, q", "weak"})
    if (name.starts_with(green)) return 1;
  return 2;
}

}  // namespace
}  // namespace tankrig

int main() {
  using namespace tankrig;
  constexpr std::uint64_t kSeeds[] = {1, 2, 3};
  enum Method { kRaw, kSmooth, kSteger, kParabola, kMass, kPaper, kMethods };
  std::vector<std::array<Score, kMethods>> scores;
  std::vector<StripeScene> scenes;
  for (const std::uint64_t seed : kSeeds) {
    scenes = stripe_scenes(seed);
    scores.resize(scenes.size());
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      const StripeScene& scene = scenes[i];
      StripeParameters ours;
      add_peaks(scene, detect_stripe(scene.image, scene.background, ours), scores[i][kSmooth]);
      ours.smoothing_px = 0;
      add_peaks(scene, detect_stripe(scene.image, scene.background, ours), scores[i][kRaw]);
      const cv::Mat1f light = peer_light(scene.image, scene.background, laser_channel(scene.name));
      constexpr double kThreshold = 12;
      add_rows(scene, steger_ridge(light, 2, kThreshold), scores[i][kSteger]);
      add_rows(scene, log_parabola(light, kThreshold), scores[i][kParabola]);
      add_rows(scene, centre_of_mass(light, 5, kThreshold), scores[i][kMass]);
      PaperStripeParameters paper = PaperStripeParameters::simulation();
      paper.hue_min = 0, paper.hue_max = 179;
      add_peaks(scene, detect_paper(scene.image, paper), scores[i][kPaper]);
    }
  }
  std::printf(
      "| scene | bound px | ours, not smoothed | ours | Steger | log-parabola | centre of mass | paper | ours: error "
      "over sigma, not smoothed, smoothed |\n|---|---|---|---|---|---|---|---|---|\n");
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    std::printf("| %s | ", scenes[i].name.c_str());
    scenes[i].bound_px > 0 ? std::printf("%.3f", scenes[i].bound_px) : std::printf("-");
    for (const Score& score : scores[i]) score.print();
    const auto z = [](const Score& s) { return s.sigmas ? std::sqrt(s.normalised / s.sigmas) : NAN; };
    std::printf(" | %.2f, %.2f |\n", z(scores[i][kRaw]), z(scores[i][kSmooth]));
  }
}
