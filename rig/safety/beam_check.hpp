// Whether a camera sees the laser's stripe, by comparing a picture with the same camera's dark ones.
#pragma once

#include <opencv2/core.hpp>
#include <optional>

namespace tankrig {

/// Mean of pictures without a beam.
/// Threads: one.
/// RT: never.
class DarkReference {
 public:
  /// 8-bit, 1 or 3 channels. A picture of another size or type starts again.
  void add(const cv::Mat& picture);
  int count() const { return count_; }
  /// As 8-bit; empty before the first.
  const cv::Mat& mean() const { return mean_; }

 private:
  cv::Mat sum_, mean_;
  int count_ = 0;
};

/// Evidence of a stripe.
struct StripeSign {
  /// So many triples are a stripe. A picture without one has those that the arm's own edges make; how many it has on the
  /// simulated rigs, and one with a stripe, docs/reference/safety.md says.
  static constexpr int kPresent = 16;
  static constexpr int kSmallest = 240;  ///< rows and columns of a picture that can be judged

  int triples = 0;      ///< of neighbouring profiles whose highest ridges lie in a line; noise gives one in 20 pictures
  double contrast = 0;  ///< their median ridge over what is beside it [grey levels of one channel]

  bool present() const noexcept { return triples >= kPresent; }
};

/// Looks across columns and across rows; the better one counts. A ridge is brighter than both of its sides, so edges,
/// shadows and other lamps do not count. Noise and particles do not line up. `picture` and `dark` have the same size
/// and type, 8-bit, 1 or 3 channels, at least kSmallest x kSmallest; otherwise the result is empty.
/// Threads: const and safe.
/// RT: never.
std::optional<StripeSign> look_for_stripe(const cv::Mat& picture, const cv::Mat& dark);

}  // namespace tankrig
