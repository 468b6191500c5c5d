#include "apps/tankrig/calibrate_all/judged_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/tankrig/command_line/feed.hpp"
#include "console/feed/feed_format.hpp"

namespace tankrig::app {
namespace {

const cv::Scalar kCounts{60, 200, 0}, kDoesNot{0, 140, 255};
constexpr int kRingsPerWidth = 120;  // a ring's radius: this part of the picture's width

}  // namespace

std::string that_count(std::size_t pictures, const std::string& of) {
  return pictures == 1 ? fmt::format("1 picture of {} counts", of)
                       : fmt::format("{} pictures of {} count", pictures, of);
}

std::string so_far_in_words(const JudgedMoment& moment) {
  std::string counts, covers;
  for (const JudgedPicture& p : moment.cameras) {
    counts += fmt::format("{}{} {}", counts.empty() ? "" : ", ", p.camera, p.pictures);
    covers += fmt::format("{}{}", covers.empty() ? "" : ", ", p.so_far);
  }
  return fmt::format("{} of {}; {}", counts, moment.enough, covers);
}

std::string in_words(const JudgedMoment& moment) {
  std::string words = fmt::format("picture {}: ", moment.picture);
  for (const JudgedPicture& p : moment.cameras)
    words += p.camera + (p.why_not.empty() ? " counts; " : ": " + p.why_not + "; ");
  return words + "so far " + so_far_in_words(moment);
}

cv::Mat marked_picture(const JudgedPicture& picture) {
  cv::Mat drawn;
  if (picture.image.channels() == 1)
    cv::cvtColor(picture.image, drawn, cv::COLOR_GRAY2BGR);
  else
    drawn = picture.image.clone();
  const int radius = std::max(3, drawn.cols / kRingsPerWidth);
  for (const Vector2d& mark : picture.marks)
    cv::circle(drawn, {cvRound(mark.x()), cvRound(mark.y())}, radius, picture.why_not.empty() ? kCounts : kDoesNot,
               std::max(1, radius / 3), cv::LINE_AA);
  return drawn;
}

void show(const JudgedMoment& moment) {
  if (!Feed::one().heard()) return;
  nlohmann::ordered_json said{{"feed", "judged"},
                              {"target", moment.target},
                              {"picture", moment.picture},
                              {"enough", moment.enough},
                              {"missing", moment.missing}};
  for (const JudgedPicture& p : moment.cameras)
    said["cameras"].push_back({{"name", p.camera},
                               {"found", p.found},
                               {"counts", p.why_not.empty()},
                               {"why_not", p.why_not},
                               {"pictures", p.pictures},
                               {"so_far", p.so_far}});
  Feed::one().tell(said);
  for (const JudgedPicture& p : moment.cameras) Feed::one().picture(kJudgedPicture + p.camera, marked_picture(p));
}

}  // namespace tankrig::app
