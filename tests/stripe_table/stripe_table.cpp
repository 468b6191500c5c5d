// The table of detectors: ours with and without smoothing, published peers and the paper's, over the scenes of the
// second generator, and over photographs where their folder is given. Prints Markdown, as docs/measured/stripes.md
// holds it.
//
//   stripe_table [FOLDER]
#include <cmath>
#include <cstdio>
#include <exception>

#include "tests/stripe_table/stripe_methods.hpp"
#include "tests/stripe_table/stripe_photographs.hpp"
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

/// Ours and Steger's on the columns where both are right: what a method leaves out does not make it better here.
struct Beside {
  double ours = 0, steger = 0;
  int both = 0;

  void add(double truth, double our_row, double steger_row) {
    const double our_error = our_row - truth, steger_error = steger_row - truth;
    if (!(std::abs(our_error) <= kGross && std::abs(steger_error) <= kGross)) return;
    ++both;
    ours += our_error * our_error, steger += steger_error * steger_error;
  }
  void print() const {
    both ? std::printf(" | %.3f, %.3f", std::sqrt(ours / both), std::sqrt(steger / both)) : std::printf(" | -");
  }
};

int laser_channel(const std::string& name) {
  for (const char* green : {"wide, 40", "speckle,", "board with", "JPEG, q", "weak"})
    if (name.starts_with(green)) return 1;
  return 2;
}

}  // namespace
}  // namespace tankrig

int main(int argc, char** argv) {
  using namespace tankrig;
  constexpr std::uint64_t kSeeds[] = {1, 2, 3};
  std::vector<std::array<Score, kMethods>> scores;
  std::vector<Beside> beside;
  std::vector<StripeScene> scenes;
  for (const std::uint64_t seed : kSeeds) {
    scenes = stripe_scenes(seed);
    scores.resize(scenes.size());
    beside.resize(scenes.size());
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      const StripeScene& scene = scenes[i];
      const auto found =
          detect_by_all(scene.image, scene.background, StripeOrientation::kColumns, laser_channel(scene.name));
      for (int m = 0; m < kMethods; ++m)
        for (std::size_t x = 0; x < scene.truth.size(); ++x)
          scores[i][m].add(scene.truth[x], found[m].position[x], found[m].sigma[x]);
      for (std::size_t x = 0; x < scene.truth.size(); ++x)
        beside[i].add(scene.truth[x], found[kSmooth].position[x], found[kSteger].position[x]);
    }
  }
  std::printf("| scene | bound px");
  for (const char* method : kMethodNames) std::printf(" | %s", method);
  std::printf(
      " | on the columns of both: ours, Steger | ours: error over sigma, not smoothed, smoothed |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    std::printf("| %s | ", scenes[i].name.c_str());
    scenes[i].bound_px > 0 ? std::printf("%.3f", scenes[i].bound_px) : std::printf("-");
    for (const Score& score : scores[i]) score.print();
    beside[i].print();
    const auto z = [](const Score& s) { return s.sigmas ? std::sqrt(s.normalised / s.sigmas) : NAN; };
    std::printf(" | %.2f, %.2f |\n", z(scores[i][kRaw]), z(scores[i][kSmooth]));
  }
  if (argc < 2) return 0;
  try {
    print_photographs(argv[1]);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "stripe_table: %s\n", e.what());
    return 1;
  }
}
