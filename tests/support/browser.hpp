// Pages in a browser without a screen: what they look like, what they have become, and what they load from elsewhere.
#pragma once

#include <cstdlib>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace tankrig {

inline bool has_browser() { return std::system("command -v chromium-headless-shell > /dev/null") == 0; }
inline constexpr const char* kNoBrowser = "no chromium-headless-shell (Debian package of that name)";

class Browser {
 public:
  explicit Browser(const std::string& html) { folder_.write("page.html", html); }

  /// In a window; `place` is put behind the page's name. Empty: it failed.
  cv::Mat drawn(cv::Size window, const std::string& place = "") const {
    const std::string shot = path("page.png");
    const std::string size = std::to_string(window.width) + "," + std::to_string(window.height);
    if (!run("--hide-scrollbars --window-size=" + size + " --log-net-log=" + path("net.json") + " --screenshot=" + shot,
             place, "/dev/null"))
      return {};
    return cv::imread(shot);
  }
  /// Addresses that the last drawing asked for beyond the page itself.
  std::vector<std::string> leads_out_to() const {
    std::vector<std::string> out;
    const std::string text = folder_.read("net.json");
    constexpr std::string_view kAddress = "\"url\":\"";
    for (std::size_t at = text.find(kAddress); at != std::string::npos; at = text.find(kAddress, at)) {
      at += kAddress.size();
      const std::string address = text.substr(at, text.find('"', at) - at);
      bool own = false;
      for (const char* scheme : {"file:", "data:", "blob:", "about:", "chrome:"})
        own = own || address.starts_with(scheme);
      if (!own) out.push_back(address);
    }
    return out;
  }
  /// Its elements after its programs have run, as text.
  std::string elements() const {
    if (!run("--window-size=1280,1400 --dump-dom", "", path("dom.html"))) return "";
    std::stringstream text;
    text << std::ifstream(path("dom.html")).rdbuf();
    return text.str();
  }

 private:
  std::string path(const char* name) const { return (folder_.path() / name).string(); }
  bool run(const std::string& flags, const std::string& place, const std::string& out) const {
    const std::string command =
        "HOME=" + folder_.path().string() +
        " timeout 200 chromium-headless-shell --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader "
        "--disable-dev-shm-usage --virtual-time-budget=5000 " +
        flags + " 'file://" + path("page.html") + place + "' > " + out + " 2> /dev/null";
    return std::system(command.c_str()) == 0;
  }

  TemporaryFolder folder_;
};

/// How many pixels have about this colour.
inline int pixels_like(const cv::Mat& picture, const cv::Scalar& bgr) {
  cv::Mat like;
  cv::inRange(picture, bgr - cv::Scalar::all(12), bgr + cv::Scalar::all(12), like);
  return cv::countNonZero(like);
}

/// Whether its last ten columns are white: nothing leads out of the window.
inline bool ends_inside(const cv::Mat& picture) {
  cv::Mat ink;
  cv::inRange(picture.colRange(picture.cols - 10, picture.cols), cv::Scalar::all(0), cv::Scalar::all(250), ink);
  return cv::countNonZero(ink) == 0;
}

}  // namespace tankrig
