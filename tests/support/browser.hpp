// A page as a browser draws it, and what it loads from other hosts meanwhile.
#pragma once

#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace tankrig::testing_support {

inline constexpr const char* kBrowser = "chromium-headless-shell";
inline constexpr const char* kNoBrowser = "no chromium-headless-shell (Debian package of that name)";

inline bool has_browser() { return std::system(("command -v " + std::string(kBrowser) + " > /dev/null").c_str()) == 0; }

struct DrawnPage {
  cv::Mat picture;                        ///< of the window's size; empty if the browser failed
  std::vector<std::string> leads_out_to;  ///< addresses that it asked for beyond the page itself
};

/// `html`, whole, in a window of that size.
inline DrawnPage drawn_by_browser(const std::string& html, const cv::Size& window) {
  const TemporaryFolder folder;
  const std::string page = folder.write("page.html", html).string(), shot = (folder.path() / "page.png").string(),
                    log = (folder.path() / "net.json").string();
  const std::string command =
      "HOME=" + folder.path().string() + " timeout 200 " + kBrowser +
      " --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --disable-dev-shm-usage --hide-scrollbars "
      "--virtual-time-budget=5000 --window-size=" +
      std::to_string(window.width) + "," + std::to_string(window.height) + " --log-net-log=" + log +
      " --screenshot=" + shot + " file://" + page + " > /dev/null 2>&1";
  if (std::system(command.c_str()) != 0) return {};
  DrawnPage drawn{cv::imread(shot), {}};
  const std::string text = folder.read("net.json");
  constexpr std::string_view kAddress = "\"url\":\"";
  for (std::size_t at = text.find(kAddress); at != std::string::npos; at = text.find(kAddress, at)) {
    at += kAddress.size();
    const std::string address = text.substr(at, text.find('"', at) - at);
    bool own = false;
    for (const char* scheme : {"file:", "data:", "blob:", "about:", "chrome:"})
      own = own || address.starts_with(scheme);
    if (!own) drawn.leads_out_to.push_back(address);
  }
  return drawn;
}

/// How many are of this colour, but for what smoothing leaves of it.
inline int pixels_like(const cv::Mat& picture, const cv::Scalar& bgr) {
  cv::Mat like;
  cv::inRange(picture, bgr - cv::Scalar::all(12), bgr + cv::Scalar::all(12), like);
  return cv::countNonZero(like);
}

/// Whether the page is wider than its window: its white margin on the right is not empty.
inline bool is_cut_off(const cv::Mat& picture) {
  cv::Mat ink;
  cv::inRange(picture.colRange(picture.cols - 10, picture.cols), cv::Scalar::all(0), cv::Scalar::all(250), ink);
  return cv::countNonZero(ink) > 0;
}

}  // namespace tankrig::testing_support
