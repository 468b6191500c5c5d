// Corners that another program found: read line by line, and refused by name.
#include "calibration/boards/corner_table.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

constexpr char kHeader[] = "picture,width_px,height_px,corner,x_px,y_px\n";

BoardTarget target() { return board_target(TargetKind::kCheckerboard, "4x3", 0.03); }

/// Corners 0 to `count`, 40 px apart; `along` -1: mirrored.
std::string corners(const std::string& picture, int count, int along = 1) {
  std::string lines;
  for (int i = 0; i < count; ++i)
    lines += fmt::format("{},640,480,{},{},{}.5\n", picture, i, 300 + along * 40 * (i % 4), 100 + 40 * (i / 4));
  return lines;
}

CornerTable read(const std::string& text) {
  const TemporaryFolder folder;
  return read_corner_table(folder.write("corners.csv", text), target());
}

TEST(CornerTable, HoldsThePicturesOfOneCamera) {
  const CornerTable table = read(kHeader + corners("b.png", 12) + corners("a.png", 7));
  EXPECT_EQ(table.size, cv::Size(640, 480));
  ASSERT_EQ(table.pictures.size(), 2u);
  EXPECT_EQ(table.pictures[0].name, "b.png");
  ASSERT_TRUE(table.pictures[0].search.board && table.pictures[1].search.board);
  EXPECT_EQ(table.pictures[0].search.board->ids.size(), 12u);
  EXPECT_EQ(table.pictures[0].search.board->pixels[5], Vector2d(340, 140.5));
  EXPECT_EQ(table.pictures[1].search.board->ids.back(), 6) << "half seen";
}

TEST(CornerTable, RefusesAPictureThatIsMirroredOrHasTooFewCorners) {
  const CornerTable table = read(kHeader + corners("m.png", 12, -1) + corners("few.png", 5));
  EXPECT_FALSE(table.pictures[0].search.board);
  EXPECT_THAT(table.pictures[0].search.refused, HasSubstr("go round the other way"));
  EXPECT_EQ(table.pictures[1].search.refused, "found 5 corners, expected 6 at least");
}

TEST(CornerTable, NamesLineAndColumnOfBadInput) {
  const auto error = [](const std::string& lines) {
    return message_of<InputError>([&] { read(kHeader + corners("a.png", 12) + lines); });
  };
  EXPECT_THAT(error("b.png,640,480,12,1,1\n"),
              HasSubstr("corners.csv:14: corner: found '12', expected a whole number from 0 to 11"));
  EXPECT_THAT(error("b.png,640,480,0,nan,1\n"), HasSubstr("corners.csv:14: x_px: found 'nan'"));
  EXPECT_THAT(error("b.png,640,480,0,1,480\n"),
              HasSubstr("y_px: found '480', expected a place in the picture, from -0.5 to 479.5"));
  EXPECT_THAT(error("a.png,640,480,3,1,1\n"), HasSubstr("corner: found '3', expected each corner of a picture once"));
  EXPECT_THAT(error("b.png,480,640,3,1,1\n"), HasSubstr("width_px: found '480', expected 640 x 480"));
  EXPECT_THAT(error("b.png,640,480,3,1\n"), HasSubstr("corners.csv:14: found 5 fields, expected 6"));
  EXPECT_THAT(error("b.png,640,480,3,1,"), HasSubstr("ends within a line"));
  EXPECT_THAT(message_of<InputError>([] { read("x,y\n1,2\n"); }), HasSubstr("corners.csv:1: column 1: found 'x'"));
}

}  // namespace
}  // namespace tankrig
