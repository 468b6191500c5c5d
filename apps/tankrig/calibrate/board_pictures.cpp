#include "apps/tankrig/calibrate/board_pictures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "core/regular_file.hpp"
#include "core/shown_text.hpp"
#include "session/reading/picture_file.hpp"

namespace tankrig::app {

void add_target_options(CLI::App* c, TargetOptions& o) {
  c->add_option("--pattern", o.pattern, "COLUMNSxROWS of inner corners (9x6: ten by seven squares), or of dots")
      ->required();
  c->add_option("--square-mm", o.square_mm, "Side of a square; from dot to dot; asymmetric dots: from row to row")
      ->required();
  c->add_option("--target", o.kind, "What the target is")
      ->check(CLI::IsMember(std::vector<std::string>(kNames<TargetKind>.begin(), kNames<TargetKind>.end())))
      ->capture_default_str();
  c->add_option("--marker-mm", o.marker_mm, "ChArUco: side of a marker");
  c->add_option("--dictionary", o.dictionary, "ChArUco: original, or 4x4, 5x5, 6x6, 7x7 with _50, _100, _250, _1000")
      ->capture_default_str();
}

BoardTarget target_of(const TargetOptions& o) {
  const auto kind =
      std::find(kNames<TargetKind>.begin(), kNames<TargetKind>.end(), o.kind) - kNames<TargetKind>.begin();
  return board_target(static_cast<TargetKind>(kind), o.pattern, 1e-3 * o.square_mm, 1e-3 * o.marker_mm, o.dictionary);
}

SearchedPictures search_pictures(const std::vector<std::filesystem::path>& files, const BoardTarget& target,
                                 Progress& progress) {
  SearchedPictures searched;
  for (const std::filesystem::path& file : files) {
    progress.update("looking for the target", double(searched.pictures.size()) / double(files.size()));
    const std::string bytes = read_regular_file(file, kMostPictureBytes, "a picture");
    const ExpectedSize first{searched.size.width, searched.size.height,
                             "as in " + files.front().filename().string() + ": pictures of one camera"};
    const cv::Mat grey = decode_picture(bytes, file, searched.pictures.empty() ? nullptr : &first,
                                        cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (searched.pictures.empty()) searched.size = grey.size();
    SearchedPicture picture{file.filename().string(), find_board(grey, target)};
    if (!picture.search.board) progress.warn(shown_text(picture.name) + ": " + picture.search.refused);
    searched.pictures.push_back(std::move(picture));
  }
  progress.finish_line();
  return searched;
}

}  // namespace tankrig::app
