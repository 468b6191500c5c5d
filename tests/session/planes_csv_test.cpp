// Planes as people write them.
#include "session/import/planes_csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tankrig {
namespace {

using testing::HasSubstr;

TEST(ParsePlane, ScalesToAUnitNormal) {
  const Plane plane = parse_plane(" 0, 3,-4 , 2.5");
  EXPECT_TRUE(plane.normal.isApprox(Vector3d(0, 0.6, -0.8), 1e-15));
  EXPECT_DOUBLE_EQ(plane.offset, 0.5);
}

TEST(ParsePlane, OnlyALasersPlaneMustNotPassThroughTheOrigin) {
  EXPECT_EQ(parse_plane("0,0,1,0").offset, 0);
  EXPECT_THROW(parse_laser_plane("0,0,1,0"), InputError);
}

TEST(ParsePlane, SaysWhatIsWrong) {
  const auto error = [](const char* text) { return message_of<InputError>([&] { parse_laser_plane(text); }); };
  EXPECT_THAT(error("1,2,3"), HasSubstr("plane '1,2,3': found 3 numbers, expected a,b,c,d"));
  EXPECT_THAT(error("1,2,x,4"), HasSubstr("found 'x', expected a number"));
  EXPECT_THAT(error("1,2,,4"), HasSubstr("found '', expected a number"));
  EXPECT_THAT(error("0,0,0,4"), HasSubstr("normal a,b,c of length 0"));
  EXPECT_THAT(error("1,0,0,0"), HasSubstr("through the camera's centre"));
  EXPECT_THAT(error("0,0,1,39.52"), HasSubstr("found d = 39.52, longer than a tank (20 m): looks like millimetres"));
  EXPECT_THAT(error("inf,0,0,1"), HasSubstr("found 'inf'"));
}

TEST(PlanesCsv, ReadsOnePlaneAFileWithOrWithoutHeader) {
  const TemporaryFolder folder;
  for (const char* header : {"", "file,a,b,c,d\n"}) {
    const auto planes =
        read_planes_csv(folder.write("p.csv", std::string(header) + "a.png,1,0,0,-0.5\n\"b,c.png\", 0,0,2,1\n"));
    ASSERT_EQ(planes.size(), 2u);
    EXPECT_EQ(planes.at("a.png").offset, -0.5);
    EXPECT_EQ(planes.at("b,c.png").offset, 0.5);
  }
}

TEST(PlanesCsv, NamesFileAndLineOfBadInput) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& text) {
    return message_of<InputError>([&] { read_planes_csv(folder.write("p.csv", text)); });
  };
  EXPECT_THAT(error("file,a,b,c,d\na.png,1,0,0\n"), HasSubstr("p.csv:2: found 4 fields, expected 5: file,a,b,c,d"));
  EXPECT_THAT(error("a.png,1,0,0,1\na.png,1,0,0,1\n"), HasSubstr("p.csv:2: found 'a.png' for the second time"));
  EXPECT_THAT(error(""), HasSubstr("p.csv: holds no plane"));
  EXPECT_THAT(message_of<InputError>([&] { read_planes_csv(folder.path() / "no.csv"); }),
              HasSubstr("no.csv: cannot be read"));
}

TEST(PlanesCsv, TakesTheColumnsInTheOrderOfItsHeader) {
  const TemporaryFolder folder;
  const auto planes = read_planes_csv(folder.write("p.csv", "d, c,b,a,file\r\n-0.5,0,0,1,a.png\r\n"));
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes.at("a.png").normal, Vector3d::UnitX());
  EXPECT_EQ(planes.at("a.png").offset, -0.5);
}

TEST(PlanesCsv, SkipsAByteOrderMark) {
  const TemporaryFolder folder;
  for (const char* header : {"", "file,a,b,c,d\n"})
    EXPECT_EQ(read_planes_csv(folder.write("p.csv", std::string("\xef\xbb\xbf") + header + "a.png,1,0,0,-0.5\n"))
                  .count("a.png"),
              1u);
}

TEST(PlanesCsv, RefusesAHeaderWithOtherColumns) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& header) {
    return message_of<InputError>([&] { read_planes_csv(folder.write("p.csv", header + "\na.png,1,0,0,-0.5\n")); });
  };
  EXPECT_THAT(error("name,a,b,c,d"),
              HasSubstr("p.csv:1: column 1: found 'name', expected exactly the columns file,a,b,c,d"));
  EXPECT_THAT(error("file,a,b,c,d,e"), HasSubstr("p.csv:1: column 6: found 'e'"));
  EXPECT_THAT(error("file,a,b,b,d"), HasSubstr("p.csv:1: column 4: found 'b' for the second time"));
  EXPECT_THAT(error("file,a,b,d"), HasSubstr("p.csv:1: found no column 'c'"));
  EXPECT_THAT(error("file,1,2,3,4"), HasSubstr("p.csv:1: column 2: found '1'"));
}

}  // namespace
}  // namespace tankrig
