#include "apps/tankrig/camera/camera_preview_output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "apps/tankrig/command_line/feed.hpp"
#include "apps/tankrig/scan/camera_view.hpp"
#include "core/picture_codecs.hpp"
#include "core/text_files.hpp"
#include "reconstruction/stripe/stripe.hpp"

namespace fs = std::filesystem;

namespace tankrig::app {
namespace {

constexpr Duration kRateWindow = std::chrono::seconds{1};
constexpr double kStripeShare = 0.05;  // of the columns; fewer are dust

std::string html_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

/// "[####  ]": `share` of the whole, in [0, 1].
std::string text_bar(double share) {
  constexpr std::size_t kWidth = 20;
  const auto filled = static_cast<std::size_t>(std::lround(share * kWidth));
  return "[" + std::string(filled, '#') + std::string(kWidth - filled, ' ') + "]";
}

/// A file's name as a URL beside the page.
std::string url_of(std::string_view name) {
  std::string out;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '_') {
      out += c;
    } else {
      out += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return out;
}

}  // namespace

fs::path page_of(const fs::path& picture) {
  if (picture.extension() != ".png" || picture.stem().empty())
    throw InputError("--out: found '" + picture.string() + "', expected a name that ends in .png");
  fs::path page = picture;
  return page.replace_extension(".html");
}

std::string preview_page(const std::string& title, const std::string& picture, int period_ms) {
  const std::string url = url_of(picture);
  return "<!doctype html>\n<meta charset=\"utf-8\">\n<title>" + html_text(title) +
         "</title>\n"
         "<style>body{margin:0;background:#202020}img{display:block;margin:auto;max-width:100%}</style>\n"
         "<noscript><meta http-equiv=\"refresh\" content=\"1\"></noscript>\n"
         "<img id=\"picture\" alt=\"" +
         html_text(title) + "\" src=\"" + url +
         "\">\n"
         "<script>\n"
         "const shown = document.getElementById('picture');\n"
         "function load() {\n"
         "  const next = new Image();\n"
         "  next.onload = () => { shown.src = next.src; setTimeout(load, " +
         std::to_string(period_ms) +
         "); };\n"
         "  next.onerror = () => setTimeout(load, 500);\n"
         "  next.src = '" +
         url +
         "?' + Date.now();\n"
         "}\n"
         "load();\n"
         "</script>\n";
}

PreviewOutput::PreviewOutput(fs::path picture, const std::string& title, double rate_hz)
    : picture_(std::move(picture)),
      page_(page_of(picture_)),
      title_(title),
      period_(from_seconds(1 / rate_hz)),
      terminal_(isatty(STDERR_FILENO) != 0) {
  const int period_ms = std::max(20, static_cast<int>(std::lround(1e3 / rate_hz)));
  write_whole_file(page_, preview_page("tankrig preview: " + title, picture_.filename().string(), period_ms));
}

PreviewOutput::~PreviewOutput() { finish_line(); }

void PreviewOutput::add_background(const cv::Mat& image) {
  dark_.push_back(image.clone());
  background_.release();
}

void PreviewOutput::count(Stamp stamp) {
  ++summary_.frames;
  recent_.push_back(stamp);
  while (stamp - recent_.front() > kRateWindow) recent_.pop_front();
  const double span = seconds(recent_.back() - recent_.front());
  summary_.frames_per_s = span > 0 ? static_cast<double>(recent_.size() - 1) / span : 0;
}

void PreviewOutput::add(const cv::Mat& image, Stamp stamp, bool lit, const CameraCounters& counters) {
  count(stamp);
  if (summary_.refreshes > 0 && stamp < next_) return;
  // On the grid of refreshes, so that frames a little early or late do not slow it down; late ones are not made up for.
  next_ = std::max(next_ + period_, stamp + period_ / 2);
  const std::uint64_t lost = counters.left_out();
  if (summary_.refreshes == 0) lost_before_ = lost;
  summary_.lost = lost - lost_before_;
  show(image, lit);
}

void PreviewOutput::show(const cv::Mat& image, bool lit) {
  if (background_.empty() && !dark_.empty()) background_ = median_background(dark_);
  summary_.focus = focus_of(image);
  summary_.best_focus = std::max(summary_.best_focus, summary_.focus);
  summary_.clipped_share = cv::countNonZero(clipped_mask(image)) / static_cast<double>(image.total());

  PreviewMarks marks;
  marks.focus = summary_.focus;
  marks.best_focus = summary_.best_focus;
  marks.laser = lit;
  if (lit) marks.stripe = stripe_points(image, background_);
  summary_.stripe_points = marks.stripe.size();
  width_ = image.cols;
  marks.caption = fmt::format("{}  {:.1f} frames/s  lost {}", title_, summary_.frames_per_s, summary_.lost);

  const cv::Mat picture = preview_picture(image, marks);
  Feed::one().picture(title_, picture);
  CameraView view{.name = title_, .focus = summary_.focus, .best_focus = summary_.best_focus};
  view.rate_hz = summary_.frames_per_s;
  view.clipped_share = summary_.clipped_share;
  view.lost = summary_.lost;
  show_cameras({view});
  write_whole_file(picture_, picture_png(picture));
  ++summary_.refreshes;
  print_line(lit);
}

void PreviewOutput::print_line(bool lit) {
  const bool seen = static_cast<double>(summary_.stripe_points) >= kStripeShare * static_cast<double>(width_);
  const std::string stripe = !lit   ? "laser off"
                             : seen ? fmt::format("stripe {} points", summary_.stripe_points)
                                    : "no stripe";
  const double of_best = summary_.best_focus > 0 ? summary_.focus / summary_.best_focus : 0;
  std::fputs(fmt::format("{}focus {:8.1f} {} best {:.1f}  clipped {:6.3f} %  {}  {:.1f} frames/s  lost {}{}",
                         terminal_ ? "\r" : "", summary_.focus, text_bar(of_best), summary_.best_focus,
                         100 * summary_.clipped_share, stripe, summary_.frames_per_s, summary_.lost,
                         terminal_ ? "\033[K" : "\n")
                 .c_str(),
             stderr);
  std::fflush(stderr);
  line_open_ = terminal_;
}

void PreviewOutput::finish_line() {
  if (line_open_) std::fputc('\n', stderr);
  line_open_ = false;
}

}  // namespace tankrig::app
