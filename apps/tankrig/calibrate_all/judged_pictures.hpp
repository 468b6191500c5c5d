// A step's pictures as whoever listens hears of them: what was found in each, whether it counts, and what is still missing.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/frames.hpp"

namespace tankrig::app {

struct JudgedPicture {
  std::string camera;
  std::string found;         ///< "54 corners"
  std::string why_not;       ///< empty: it counts
  std::size_t pictures = 0;  ///< of this camera that count by now
  std::string so_far;        ///< what these cover, "64 % of the image"
  cv::Mat image;
  std::vector<Vector2d> marks;  ///< where what was found lies in it [px]
};

/// Pictures of one moment.
struct JudgedMoment {
  std::string target;  ///< "board"
  int picture = 0;     ///< its number, from 1
  std::size_t enough = 0;
  std::string missing;  ///< empty: enough count
  std::vector<JudgedPicture> cameras;
  bool fault = false;  ///< something is wrong with it, and worth a line
};

/// "1 picture of the board counts", "7 pictures of the board count".
std::string that_count(std::size_t pictures, const std::string& of);

/// "left 2, mono 1 of 10; 64 % of the image, 30 % of the image".
std::string so_far_in_words(const JudgedMoment& moment);
/// "picture 3: left counts; mono: not sharp; so far left 2, mono 1 of 10".
std::string in_words(const JudgedMoment& moment);

/// The picture in colour, with a ring at each mark: green if it counts, else orange.
cv::Mat marked_picture(const JudgedPicture& picture);

/// Does nothing where nobody listens.
void show(const JudgedMoment& moment);

}  // namespace tankrig::app
