// The matched filter across the stripe: negated second derivative of a Gauss, of unit norm and zero mean.
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <opencv2/core.hpp>
#include <vector>

namespace tankrig {

/// Sd of the filter over that of the profile: near the best SNR, still local.
inline constexpr double kFilterOverProfile = 1.5;

/// Sd of the narrowest filter, in rows of what it filters.
inline constexpr double kLeastFilter = 1.1;

/// Sd of rounding to whole DN: no noise is less.
inline constexpr double kQuantisation = 0.3;

/// Weights h(0), h(1), ... of the symmetric filter; white noise keeps its sd through it.
std::vector<float> ridge_kernel(double sigma_px);

/// The image's channels times `weights`, minus the background's where there is one; `together` rows in one, in which white
/// noise keeps its sd. A rest of fewer rows is left out.
void weighted_signal(const cv::Mat& image, const cv::Mat& background, const std::array<float, 3>& weights, int together,
                     cv::Mat1f& signal);

/// The middle in the image of what is at that row where so many rows are together.
float image_row(float row, int together);

/// The filter along every column, of every `step`-th row; rows beyond the border repeat the border.
void filter_columns(const cv::Mat1f& signal, const std::vector<float>& kernel, cv::Mat1f& response, int step = 1);

/// Takes from `response` of `signal` what only one side speaks for: a stripe is brighter than both of its sides, an edge
/// of the scene than one.
void weaken_edges(const cv::Mat1f& signal, const std::vector<float>& kernel, cv::Mat1f& response);

/// Robust sd (median of absolute values) of a response with zero mean, from a sample of its pixels.
double robust_noise(const cv::Mat1f& response);

/// Of the absolute values those of the ranks, the least being of rank 0. Sizes are in the order of their bits: one bit
/// after the other is found, from the highest, by how many values are below it.
std::vector<float> ranked_sizes(const std::vector<float>& values, std::initializer_list<std::size_t> ranks);

inline constexpr double kSdOfMedian = 1.4826;  ///< of normal values: over the median of their sizes

/// By the upper median of |values|; 0 if there are none.
double robust_sd(const std::vector<float>& values);

/// A place in a column where the response peaks.
struct RidgeCandidate {
  float row = 0;  ///< [px], by a parabola
  float snr = 0;
};

/// The strongest few of each column, strongest first.
class RidgeCandidates {
 public:
  static constexpr int kPerColumn = 4;

  /// Local maxima of at least `min_snr` times `noise`, of a response in whose rows are so many of the image together.
  RidgeCandidates(const cv::Mat1f& response, double noise, double min_snr, int together = 1);

  /// Adds a place that is known otherwise to be the stripe's. A candidate within a pixel of it becomes as strong, if
  /// `strengthens`; else it stays as it is.
  void add(int column, const RidgeCandidate& candidate, bool strengthens);

  int columns() const { return static_cast<int>(counts_.size()); }
  int count(int column) const { return counts_[static_cast<std::size_t>(column)]; }
  const RidgeCandidate& at(int column, int k) const { return all_[static_cast<std::size_t>(column) * kPerColumn + k]; }

 private:
  void insert(int column, const RidgeCandidate& candidate);

  std::vector<int> counts_;
  std::vector<RidgeCandidate> all_;
};

}  // namespace tankrig
