// Where a preview goes: a picture that refreshes, a page that shows it live, a line per refresh.
#pragma once

#include <deque>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

#include "bench/report/preview_picture.hpp"
#include "core/time.hpp"
#include "drivers/camera/camera.hpp"

namespace tankrig::app {

/// What a preview has seen so far.
struct PreviewSummary {
  std::uint64_t frames = 0, refreshes = 0;
  std::uint64_t lost = 0;   ///< since the first refresh, for whatever reason the camera counts
  double frames_per_s = 0;  ///< over the last second
  double focus = 0, best_focus = 0, clipped_share = 0;
  std::size_t stripe_points = 0;  ///< of the last refresh
};

/// Takes every frame of one camera and shows one of them per refresh period.
/// Threads: one.
/// Errors: InputError if picture or page cannot be written.
class PreviewOutput {
 public:
  /// Writes the page: a folder that takes no files is told before any device is touched.
  PreviewOutput(std::filesystem::path picture, const std::string& title, double rate_hz);
  ~PreviewOutput();
  PreviewOutput(const PreviewOutput&) = delete;
  PreviewOutput& operator=(const PreviewOutput&) = delete;

  /// A frame with the laser off, before it goes on: the stripe is looked for in the difference.
  void add_background(const cv::Mat& image);
  /// `lit`: the laser was on in all of its exposure. Shown only if the refresh period has passed since the last.
  void add(const cv::Mat& image, Stamp stamp, bool lit, const CameraCounters& counters);
  /// A frame that arrived together with a newer one: counted, not shown.
  void count(Stamp stamp);

  const PreviewSummary& summary() const { return summary_; }
  const std::filesystem::path& picture() const { return picture_; }
  const std::filesystem::path& page() const { return page_; }
  /// Ends the moving line: something else is about to be printed.
  void finish_line();

 private:
  void show(const cv::Mat& image, bool lit);
  void print_line(bool lit);

  const std::filesystem::path picture_, page_;
  const std::string title_;
  const Duration period_;
  const bool terminal_;
  bool line_open_ = false;
  int width_ = 0;  // of the last picture [px]
  std::vector<cv::Mat> dark_;
  cv::Mat background_;
  std::deque<Stamp> recent_;  // stamps of the last second
  Stamp next_{};
  std::uint64_t lost_before_ = 0;
  PreviewSummary summary_;
};

/// Folder and name of the page beside a picture.
/// Errors: InputError if the picture is no .png.
std::filesystem::path page_of(const std::filesystem::path& picture);

/// Shows `picture`, a file beside it, anew every `period_ms`.
std::string preview_page(const std::string& title, const std::string& picture, int period_ms);

}  // namespace tankrig::app
