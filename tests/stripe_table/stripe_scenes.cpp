#include "tests/stripe_table/stripe_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

namespace tankrig {
namespace {

constexpr int kWidth = 480, kHeight = 360;
const cv::Vec3d kRed(0.04, 0.06, 1.0), kGreen(0.10, 1.0, 0.04);

/// How the light falls across the stripe at distance `t` from the middle of its core [px]; 1 at most.
using Profile = std::function<double(double t)>;

Profile gauss(double sd) {
  return [sd](double t) { return std::exp(-0.5 * t * t / (sd * sd)); };
}
/// A box of `width` px, blurred.
Profile flat(double width, double blur) {
  return [=](double t) {
    const double s = blur * std::sqrt(2.0);
    return 0.5 * (std::erf((t + 0.5 * width) / s) - std::erf((t - 0.5 * width) / s));
  };
}
/// A Gaussian core with haze on one side.
Profile hazy(double sd, double haze, double length) {
  return [=](double t) {
    return std::exp(-0.5 * t * t / (sd * sd)) + (t > 0 ? haze * (1 - std::exp(-t)) * std::exp(-t / length) : 0.0);
  };
}

struct Recipe {
  std::string name;
  cv::Vec3d colour = kRed;  ///< of the laser in BGR, at most 1
  double peak = 150;        ///< of its strongest channel [DN]
  Profile profile = gauss(2);
  std::function<double(int x)> row = [](int x) { return 150 + 0.11 * x + 6 * std::sin(x / 60.0); };
  std::function<cv::Vec3d(int x, int y)> scene = [](int, int) { return cv::Vec3d(6, 6, 6); };  ///< without laser [DN]
  std::function<double(int x, int y)> reflectance = [](int, int) { return 1.0; };              ///< to the laser
  double read = 1.5;                                                                           ///< sd [DN]
  double electrons_per_dn = 0;                                                                 ///< shot noise; 0: none
  double speckle = 0;                                                                          ///< contrast
  int jpeg = 0;  ///< quality; 0: not compressed
  bool grey = false, dark = false;
  double gauss_sd = 0;  ///< of the profile where the bound is to be given
};

cv::Mat render(const Recipe& r, bool laser, std::mt19937_64& random) {
  constexpr int kSteps = 5;  // of a pixel, over which its light is summed
  std::normal_distribution<double> normal;
  cv::Mat1d grain(kHeight, kWidth, 1.0);
  if (r.speckle > 0) {
    // Intensity of a smoothed complex field: exponential, about two pixels coarse; then as much of it as the contrast.
    cv::Mat1d re(kHeight, kWidth), im(kHeight, kWidth);
    for (double& v : re) v = normal(random);
    for (double& v : im) v = normal(random);
    cv::GaussianBlur(re, re, {0, 0}, 0.8);
    cv::GaussianBlur(im, im, {0, 0}, 0.8);
    cv::Mat1d intensity = re.mul(re) + im.mul(im);
    intensity /= cv::mean(intensity)[0];
    grain = 1 + r.speckle * (intensity - 1);
  }
  cv::Mat3d light(kHeight, kWidth);
  for (int x = 0; x < kWidth; ++x) {
    const double row = r.row(x);
    for (int y = 0; y < kHeight; ++y) {
      double part = 0;
      if (laser && std::isfinite(row))
        for (int k = 0; k < kSteps; ++k)
          part += r.profile(y + (k - kSteps / 2) / static_cast<double>(kSteps) - row) / kSteps;
      light(y, x) = r.scene(x, y) + r.colour * (r.peak * part * r.reflectance(x, y) * grain(y, x));
    }
  }
  cv::Mat3b out(kHeight, kWidth);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) {
        const double clean = light(y, x)[c];
        const double shot = r.electrons_per_dn > 0 ? clean / r.electrons_per_dn : 0;
        out(y, x)[c] = cv::saturate_cast<std::uint8_t>(clean + std::sqrt(r.read * r.read + shot) * normal(random));
      }
  cv::Mat image = out;
  if (r.grey) cv::cvtColor(out, image, cv::COLOR_BGR2GRAY);
  if (r.jpeg > 0) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, r.jpeg});
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  }
  return image;
}

/// Of one column's position, all channels together: 1 / sum over pixels of slope^2 / variance.
double bound_of(const Recipe& r) {
  if (!(r.gauss_sd > 0)) return 0;
  double information = 0;
  for (int c = 0; c < 3; ++c)
    for (double t = -8 * r.gauss_sd; t <= 8 * r.gauss_sd; t += 1) {
      const double light = r.peak * r.colour[c] * std::exp(-0.5 * t * t / (r.gauss_sd * r.gauss_sd));
      const double slope = light * t / (r.gauss_sd * r.gauss_sd);
      const double shot = r.electrons_per_dn > 0 ? (light + r.scene(0, 0)[c]) / r.electrons_per_dn : 0;
      information += slope * slope / (r.read * r.read + shot + 1 / 12.0);
    }
  return 1 / std::sqrt(information);
}

StripeScene made(const Recipe& r, std::mt19937_64& random) {
  StripeScene out;
  out.name = r.name;
  for (int x = 0; x < kWidth; ++x) out.truth.push_back(r.row(x));
  out.image = render(r, true, random);
  if (r.dark) out.background = render(r, false, random);
  out.bound_px = bound_of(r);
  return out;
}

bool square(int x, int y) { return (x / 45 + y / 45) % 2 == 0; }

/// A lit room: a grey gradient, a table's edge, a lamp, a window, a yellow poster, a blue chair, a red cable.
cv::Vec3d room(int x, int y) {
  cv::Vec3d v = cv::Vec3d(70, 80, 86) * (0.8 + 0.5 * x / kWidth);
  if (y > 260) v = cv::Vec3d(58, 74, 96) * (1 - 0.001 * (y - 260));
  if (std::hypot(x - 70, y - 60) < 22) v = {255, 255, 255};
  if (x > 360 && x < 440 && y > 20 && y < 110) v = {250, 244, 235};
  if (x > 200 && x < 280 && y > 30 && y < 100) v = {40, 170, 200};
  if (x > 300 && x < 380 && y > 270 && y < 340) v = {120, 60, 40};
  if (std::abs(y - 320 - 12 * std::sin(x / 25.0)) < 2 && x < 180) v = {40, 36, 150};
  return v + cv::Vec3d::all(7 * std::sin(0.35 * x + 0.2 * y) + 5 * std::sin(0.9 * y));
}

cv::Vec3d board(int x, int y) { return square(x, y) ? cv::Vec3d(95, 100, 98) : cv::Vec3d(16, 17, 17); }
double board_reflectance(int x, int y) { return square(x, y) ? 1.0 : 0.1; }

}  // namespace

std::vector<StripeScene> stripe_scenes(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<StripeScene> scenes;
  const auto add = [&](const std::string& name, const std::function<void(Recipe&)>& change) {
    Recipe recipe;
    recipe.name = name;
    change(recipe);
    scenes.push_back(made(recipe, random));
  };
  add("Gaussian, 5 px wide, darkness", [](Recipe& r) { r.gauss_sd = 2; });
  add("thin, 1 px wide", [](Recipe& r) { r.profile = gauss(0.5); });
  add("wide, 40 px", [](Recipe& r) { r.profile = gauss(r.gauss_sd = 17), r.colour = kGreen; });
  add("flat-topped, 14 px", [](Recipe& r) { r.profile = flat(14, 1.2); });
  add("skewed by haze on one side", [](Recipe& r) { r.profile = hazy(2, 0.25, 9); });
  add("speckle, contrast 0.5", [](Recipe& r) { r.speckle = 0.5, r.colour = kGreen; });
  add("wide and speckled", [](Recipe& r) { r.speckle = 0.5, r.profile = gauss(7); });
  add("shot noise", [](Recipe& r) { r.electrons_per_dn = 20, r.read = 0.5, r.gauss_sd = 2; });
  const cv::Vec3d white_core(0.30, 0.26, 1.0);
  add("clipped to white, coloured skirts, darkness",
      [&](Recipe& r) { r.peak = 1500, r.colour = white_core, r.profile = gauss(2.5); });
  add("clipped to white, lit room, no dark frame",
      [&](Recipe& r) { r.peak = 1500, r.colour = white_core, r.profile = gauss(2.5), r.scene = room, r.read = 2; });
  add("clipped to white, lit room, dark frame", [&](Recipe& r) {
    r.peak = 1500, r.colour = white_core, r.profile = gauss(2.5), r.scene = room, r.read = 2, r.dark = true;
  });
  add("lit room, no dark frame", [](Recipe& r) { r.scene = room, r.read = 2, r.peak = 110; });
  add("lit room, dark frame", [](Recipe& r) { r.scene = room, r.read = 2, r.peak = 110, r.dark = true; });
  add("board with black squares", [](Recipe& r) {
    r.scene = board, r.reflectance = board_reflectance, r.colour = kGreen, r.peak = 160, r.read = 2;
  });
  add("board, clipped on white", [&](Recipe& r) {
    r.scene = board, r.reflectance = board_reflectance, r.peak = 900, r.colour = white_core, r.read = 2;
  });
  add("JPEG, quality 75", [](Recipe& r) {
    r.scene = board, r.reflectance = board_reflectance, r.jpeg = 75, r.colour = kGreen, r.read = 2;
  });
  add("JPEG, lit room, no dark frame", [](Recipe& r) { r.scene = room, r.jpeg = 75, r.read = 2; });
  add("diagonal, 42 degrees", [](Recipe& r) { r.row = [](int x) { return x < 60 || x > 420 ? NAN : 0.9 * x - 40; }; });
  add("segments at four depths, gaps", [](Recipe& r) {
    r.row = [](int x) {
      const int k = x / 120;
      const double starts[] = {120, 190, 90, 230};
      return x % 120 > 105 ? NAN : starts[k] + 0.08 * (x % 120);
    };
  });
  for (const double snr : {2.0, 4.0, 8.0})
    add("weak, peak " + std::to_string(static_cast<int>(snr)) + " times the noise", [snr](Recipe& r) {
      r.read = 8, r.peak = snr * r.read, r.colour = kGreen, r.gauss_sd = 2;
      r.scene = [](int, int) { return cv::Vec3d(60, 60, 60); };
      r.row = [](int x) { return 150 + 0.11 * x; };
    });
  add("grey image, darkness", [](Recipe& r) { r.grey = true, r.colour = {1, 1, 1}, r.gauss_sd = 0; });
  add("grey image, board", [](Recipe& r) {
    r.grey = true, r.colour = {1, 1, 1}, r.scene = board, r.reflectance = board_reflectance, r.peak = 140;
  });
  add("no stripe, lit room", [](Recipe& r) { r.scene = room, r.read = 2, r.row = [](int) { return NAN; }; });
  add("no stripe, noise", [](Recipe& r) {
    r.read = 8, r.row = [](int) { return NAN; }, r.scene = [](int, int) { return cv::Vec3d(60, 60, 60); };
  });
  return scenes;
}

}  // namespace tankrig
