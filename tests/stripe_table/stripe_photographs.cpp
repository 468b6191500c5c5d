#include "tests/stripe_table/stripe_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "core/input_error.hpp"
#include "tests/stripe_table/stripe_methods.hpp"

namespace fs = std::filesystem;

namespace tankrig {
namespace {

/// Columns (rows, for kRows) in which the stripe lies on one plane; last 0: all.
struct Piece {
  const char* file;
  int first = 0, last = 0;
};

struct PhotographSet {
  const char* name;
  const char* folder;
  StripeOrientation orientation;
  int channel;         ///< of the laser: 0 B, 1 G, 2 R
  double band_px;      ///< from a piece's line within which a point belongs to it
  std::string camera;  ///< below the folder; empty: pieces are straight in the raw image
  std::vector<Piece> pieces;
};

constexpr auto kColumns = StripeOrientation::kColumns, kRows = StripeOrientation::kRows;

const std::vector<PhotographSet>& photograph_sets() {
  static const std::vector<PhotographSet> sets{
      {"green on boards, webcam",
       "real_stripes",
       kRows,
       1,
       2,
       "camera.yaml",
       {{"images/0_right.jpg", 115, 430},
        {"images/1_right.jpg", 80, 445},
        {"images/2_right.jpg", 105, 390},
        {"images/3_right.jpg", 108, 358},
        {"images/4_right.jpg", 105, 335},
        {"images/5_right.jpg", 95, 302}}},
      {"red on boards, wide and speckled, 1280x960",
       "stripes_blaser/1280x960",
       kColumns,
       2,
       3,
       "camera.yaml",
       {{"im1.png"}, {"im2.png"}, {"im7.png"}, {"im8.png"}, {"im28.png"}, {"im29.png"}}},
      {"the same head, 640x480",
       "stripes_blaser/640x480",
       kColumns,
       2,
       2,
       "camera.yaml",
       {{"im0.png"}, {"im1.png"}, {"im8.png"}, {"im10.png"}, {"im24.png"}}},
      {"red, saturated to white, lit room, 1280x720",
       "stripes_blaser/1280x720",
       kColumns,
       2,
       2,
       "camera.yaml",
       {{"im1.png"}, {"im2.png"}, {"im3.png"}, {"im5.png"}, {"im9.png"}, {"im10.png"}, {"im11.png"}, {"im12.png"}}},
      {"the same camera, no stripe", "stripes_blaser/1280x720", kColumns, 2, 0, "", {{"im18.png"}}},
      {"red, diagonal, clipped, haze, 1920x1080",
       "stripes_diagonal",
       kColumns,
       2,
       2,
       "",
       {{"images/0.jpg", 730, 1100},
        {"images/1.jpg", 730, 1100},
        {"images/2.jpg", 730, 1100},
        {"images/3.jpg", 730, 1100}}},
      {"red on a floor, bright room, noisy",
       "stripes_floor",
       kColumns,
       2,
       2,
       "camera.yaml",
       {{"images/img0066.jpg"},
        {"images/img0070.jpg"},
        {"images/img0074.jpg"},
        {"images/img0078.jpg"},
        {"images/img0082.jpg"},
        {"images/img0086.jpg"}}},
      {"grey, folded paper, core clipped",
       "stripes_folded",
       kRows,
       0,
       1,
       "",
       {{"images/1Left1.jpg", 535, 665},
        {"images/1Left1.jpg", 690, 825},
        {"images/5Left5.jpg", 535, 665},
        {"images/5Left5.jpg", 690, 825},
        {"images/9Left9.jpg", 535, 665},
        {"images/9Left9.jpg", 690, 825},
        {"images/10Right1.jpg", 550, 685},
        {"images/10Right1.jpg", 712, 838},
        {"images/14Right5.jpg", 550, 685},
        {"images/14Right5.jpg", 712, 838},
        {"images/18Right9.jpg", 550, 685},
        {"images/18Right9.jpg", 712, 838}}},
      {"red, folded paper, near-white core",
       "stripes_folded",
       kRows,
       2,
       3,
       "",
       {{"images/laserr.jpg", 5, 350}, {"images/laserr.jpg", 390, 745}}},
      {"red, strongly saturated: wall",
       "stripes_saturated",
       kRows,
       2,
       1.5,
       "",
       {{"images/cube.jpg", 0, 143}, {"images/adapter.jpg", 0, 214}, {"images/train2.jpg", 0, 158}}},
      {"red, strongly saturated: objects",
       "stripes_saturated",
       kRows,
       2,
       1.5,
       "",
       {{"images/cube.jpg", 185, 295}, {"images/train2.jpg", 175, 313}}}};
  return sets;
}

struct LinePoint {
  double x, y, sigma;  ///< without distortion; along and across the stripe [px]
};

struct StraightLine {
  double offset = 0, slope = 0;
  double residual(const LinePoint& p) const { return p.y - offset - slope * p.x; }
};

StraightLine line_of(const std::vector<LinePoint>& points) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const LinePoint& p : points) n += 1, x += p.x, y += p.y, xx += p.x * p.x, xy += p.x * p.y;
  const double slope = (n * xy - x * y) / (n * xx - x * x);
  return {(y - slope * x) / n, slope};
}

std::vector<LinePoint> within(const std::vector<LinePoint>& points, const StraightLine& line, double band) {
  std::vector<LinePoint> out;
  for (const LinePoint& p : points)
    if (std::abs(line.residual(p)) <= band) out.push_back(p);
  return out;
}

/// The points within `band` of the line that has most of them, of lines through pairs spread over the piece.
std::vector<LinePoint> on_one_line(const std::vector<LinePoint>& points, double band) {
  constexpr std::size_t kEnds = 40;
  std::vector<LinePoint> best;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kEnds);
  for (std::size_t i = 0; i < points.size(); i += step)
    for (std::size_t k = i + 5 * step; k < points.size(); k += step) {
      const double slope = (points[k].y - points[i].y) / (points[k].x - points[i].x);
      std::vector<LinePoint> near = within(points, {points[i].y - slope * points[i].x, slope}, band);
      if (near.size() > best.size()) best = std::move(near);
    }
  for (int round = 0; round < 3 && best.size() > 2; ++round) best = within(points, line_of(best), band);
  return best;
}

struct LineScore {
  double squares = 0, local_squares = 0, normalised = 0;
  std::size_t on = 0, local = 0, normal = 0, off = 0, columns = 0;

  void add(const std::vector<LinePoint>& points, double band, std::size_t piece_columns) {
    const std::vector<LinePoint> inside = on_one_line(points, band);
    columns += piece_columns;
    on += inside.size();
    off += points.size() - inside.size();
    if (inside.size() < 3) return;
    const StraightLine line = line_of(inside);
    for (const LinePoint& p : inside) squares += std::pow(line.residual(p), 2);
    add_local(inside);
  }

  void print() const {
    const auto percent = [&](std::size_t n) { return 100.0 * static_cast<double>(n) / static_cast<double>(columns); };
    const auto rms = [](double sum, std::size_t n) { return std::sqrt(sum / static_cast<double>(n)); };
    if (local > 0)
      std::printf(" | %.3f / %.3f / %.1f / %.1f", rms(squares, on), rms(local_squares, local), percent(on),
                  percent(off));
    else
      std::printf(" | - / - / %.1f / %.1f", percent(on), percent(off));
  }

  double error_over_sigma() const { return normal ? std::sqrt(normalised / static_cast<double>(normal)) : NAN; }

 private:
  /// About lines of forty columns: what a board bends or a lens was calibrated wrong does not count.
  void add_local(const std::vector<LinePoint>& inside) {
    constexpr double kLength = 40;
    constexpr std::size_t kLeast = 10;
    for (std::size_t i = 0; i < inside.size();) {
      std::size_t end = i;
      while (end < inside.size() && std::abs(inside[end].x - inside[i].x) < kLength) ++end;
      const std::vector<LinePoint> part(inside.begin() + static_cast<std::ptrdiff_t>(i),
                                        inside.begin() + static_cast<std::ptrdiff_t>(end));
      i = end;
      if (part.size() < kLeast) continue;
      const StraightLine line = line_of(part);
      const double freedom = 1 - 2.0 / static_cast<double>(part.size());
      for (const LinePoint& p : part) {
        const double square = std::pow(line.residual(p), 2) / freedom;
        local_squares += square, ++local;
        if (p.sigma > 0) normalised += square / (p.sigma * p.sigma), ++normal;
      }
    }
  }
};

struct Lens {
  cv::Mat matrix, distortion;  ///< empty: none

  explicit Lens(const fs::path& file) {
    if (file.empty()) return;
    const cv::FileStorage storage(file.string(), cv::FileStorage::READ);
    if (!storage.isOpened()) throw InputError(file, "found no file, expected a camera");
    storage["camera_matrix"] >> matrix;
    storage["distortion_coefficients"] >> distortion;
    if (matrix.empty()) throw InputError(file, "found no camera_matrix, expected one");
  }

  /// Points of the piece, straightened.
  std::vector<LinePoint> points(const FoundStripe& found, bool rows, std::size_t first, std::size_t last) const {
    std::vector<cv::Point2d> pixels;
    std::vector<double> sigmas;
    for (std::size_t x = first; x < last; ++x) {
      if (std::isnan(found.position[x])) continue;
      const auto along = static_cast<double>(x);
      pixels.push_back(rows ? cv::Point2d(found.position[x], along) : cv::Point2d(along, found.position[x]));
      sigmas.push_back(found.sigma[x]);
    }
    if (!matrix.empty() && !pixels.empty()) {
      std::vector<cv::Point2d> straight;
      cv::undistortPoints(pixels, straight, matrix, distortion, cv::noArray(), matrix);
      pixels = straight;
    }
    std::vector<LinePoint> out;
    for (std::size_t i = 0; i < pixels.size(); ++i)
      out.push_back({rows ? pixels[i].y : pixels[i].x, rows ? pixels[i].x : pixels[i].y, sigmas[i]});
    return out;
  }
};

cv::Mat photograph(const fs::path& file) {
  cv::Mat image = cv::imread(file.string(), cv::IMREAD_ANYCOLOR);
  if (image.empty()) throw InputError(file, "found no readable picture, expected a photograph");
  return image;
}

void print_set(const PhotographSet& set, const fs::path& folder) {
  const Lens lens(set.camera.empty() ? fs::path() : folder / set.camera);
  const bool rows = set.orientation == kRows;
  std::array<LineScore, kMethods> scores;
  std::array<FoundStripe, kMethods> found;
  std::string shown;
  for (const Piece& piece : set.pieces) {
    if (piece.file != shown) {
      found = detect_by_all(photograph(folder / piece.file), {}, set.orientation, set.channel);
      shown = piece.file;
    }
    const std::size_t columns = found[kRaw].position.size();
    const auto first = static_cast<std::size_t>(piece.first);
    const auto last = piece.last > 0 ? std::min(columns, static_cast<std::size_t>(piece.last) + 1) : columns;
    for (int m = 0; m < kMethods; ++m)
      scores[m].add(lens.points(found[m], rows, first, last), set.band_px, last - first);
  }
  std::printf("| %s", set.name);
  for (const LineScore& score : scores) score.print();
  std::printf(" | %.2f |\n", scores[kRaw].error_over_sigma());
}

}  // namespace

void print_photographs(const fs::path& folder) {
  std::printf("\n| photographs");
  for (const char* method : kMethodNames) std::printf(" | %s", method);
  std::printf(" | ours: scatter over sigma, not smoothed |\n|---|---|---|---|---|---|---|---|\n");
  for (const PhotographSet& set : photograph_sets()) {
    const fs::path images = folder / set.folder;
    if (fs::is_directory(images))
      print_set(set, images);
    else
      std::printf("| %s | skipped: no folder %s |\n", set.name, set.folder);
    std::fflush(stdout);
  }
}

}  // namespace tankrig
